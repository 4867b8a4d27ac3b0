//! The page of the paper's figures.

const PAGE: &str = include_str!("../paper/page.md");
const SECTION: &str = include_str!("../paper/page_tungsten.md");
const MADE: &str = include_str!("../../docs/paper/README.md");

#[test]
fn the_page_in_docs_is_the_template_with_its_placeholders_filled() {
    let template = PAGE.replace("{{tungsten_section}}", SECTION);
    let mut parts = template.split("{{");
    let mut rest = MADE.strip_prefix(parts.next().unwrap_or_default());
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
