//! Pages as plain text with placeholders `{{name}}`.

/// A placeholder that no value has, or that does not end.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("template: {{{{{name}}}}} is not among the values: {known}")]
pub struct TemplateError {
    /// What stands in the braces.
    pub name: String,
    /// The names that have values.
    pub known: String,
}

/// The template with its placeholders replaced. Values are taken as they are.
///
/// # Errors
/// [`TemplateError`] for a placeholder without a value.
pub fn filled(template: &str, values: &[(&str, String)]) -> Result<String, TemplateError> {
    let mut parts = template.split("{{");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        let (_, value) = value.ok_or_else(|| TemplateError {
            name: name.to_owned(),
            known: values.iter().map(|v| v.0).collect::<Vec<_>>().join(", "),
        })?;
        text += value;
        text += rest;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_replaced_and_unknown_ones_named() {
        let values = [("a", "1".to_owned()), ("b", "{{a}}".to_owned())];
        assert_eq!(
            filled("x {{a}}, {{b}}\n", &values),
            Ok("x 1, {{a}}\n".to_owned())
        );
        let error = filled("{{c}}", &values).err().map(|e| e.to_string());
        let wanted = "template: {{c}} is not among the values: a, b";
        assert_eq!(error.as_deref(), Some(wanted));
    }
}
