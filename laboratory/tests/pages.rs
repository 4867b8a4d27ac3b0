//! The pages of `docs/` that programs write, against their templates.

/// Holds a page to its template: what stands between the placeholders must be there, in order, from the first character
/// to the last.
#[track_caller]
fn assert_made_of(page: &str, template: &str) {
    let mut parts = template.split("{{");
    let mut rest = page.strip_prefix(parts.next().unwrap_or_default());
    let mut parts = parts.peekable();
    while let Some(part) = parts.next() {
        let (name, fixed) = part.split_once("}}").unwrap_or(("without an end", part));
        rest = rest.and_then(|text| match parts.peek() {
            Some(_) => text.split_once(fixed).map(|(_, after)| after),
            None => text.strip_suffix(fixed),
        });
        assert!(rest.is_some(), "after {{{{{name}}}}}: {fixed}");
    }
}

#[test]
fn the_page_of_the_paper_is_its_template_filled() {
    let section = include_str!("../paper/page_tungsten.md");
    let template = include_str!("../paper/page.md").replace("{{tungsten_section}}", section);
    assert_made_of(include_str!("../../docs/paper/README.md"), &template);
}

#[test]
fn the_page_of_the_real_camera_is_its_template_filled() {
    let template = include_str!("../real_camera/page.md");
    assert_made_of(include_str!("../../docs/real-camera/README.md"), template);
}
