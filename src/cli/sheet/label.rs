//! Labels of sheets: text with names in braces, as in `{frame} {seconds:.2} {aperture}`.

use std::fmt::Write;

use crate::base::diagnostics::suggestion;
use crate::base::limits;

/// A label before its values are known.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelTemplate(Vec<LabelPiece>);

#[derive(Clone, Debug, PartialEq)]
enum LabelPiece {
    Text(String),
    Name { name: String, form: Form },
}

/// How a number is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Form {
    /// Least number of digits, filled with zeros.
    width: usize,
    decimals: Option<usize>,
}

/// Most digits that are worth asking for.
const MOST_DIGITS: usize = 20;

impl LabelTemplate {
    /// Reads `text {name} {name:.2} {name:04}`; `{{` is a brace.
    ///
    /// # Errors
    /// What cannot be understood.
    pub fn parse(text: &str) -> Result<LabelTemplate, String> {
        if text.len() > limits::TEXT_BYTES {
            return Err(format!("a label has at most {} bytes", limits::TEXT_BYTES));
        }
        let mut pieces = Vec::new();
        let mut plain = String::new();
        let mut rest = text;
        while let Some(at) = rest.find(['{', '}']) {
            plain.push_str(&rest[..at]);
            let brace = &rest[at..=at];
            let behind = &rest[at + 1..];
            if let Some(after) = behind.strip_prefix(brace) {
                plain.push_str(brace);
                rest = after;
                continue;
            }
            let end = behind.find('}').filter(|_| brace == "{");
            let end = end.ok_or_else(|| format!("`{brace}` stands alone; write `{brace}{brace}` for a brace"))?;
            if !plain.is_empty() {
                pieces.push(LabelPiece::Text(std::mem::take(&mut plain)));
            }
            pieces.push(name(&behind[..end])?);
            rest = &behind[end + 1..];
        }
        plain.push_str(rest);
        if !plain.is_empty() {
            pieces.push(LabelPiece::Text(plain));
        }
        Ok(LabelTemplate(pieces))
    }

    /// Whether nothing would be written.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The label with these values.
    ///
    /// # Errors
    /// A name that is none of theirs, with the nearest one.
    pub fn fill(&self, values: &[(String, String)]) -> Result<String, String> {
        let mut label = String::new();
        for piece in &self.0 {
            match piece {
                LabelPiece::Text(text) => label.push_str(text),
                LabelPiece::Name { name, form } => {
                    let known = values.iter().find(|(known, _)| known == name);
                    let (_, value) = known.ok_or_else(|| {
                        let names = values.iter().map(|(name, _)| name.as_str());
                        let help = suggestion(name, names).map_or(String::new(), |help| format!("; {help}"));
                        format!("--label: there is no `{name}`{help}")
                    })?;
                    form.write(value, &mut label);
                }
            }
        }
        Ok(label)
    }
}

/// `name`, `name:.2`, `name:04` or `name:06.2`.
fn name(text: &str) -> Result<LabelPiece, String> {
    let (name, form) = text.split_once(':').unwrap_or((text, ""));
    let (width, decimals) = form.split_once('.').map_or((form, None), |(width, decimals)| (width, Some(decimals)));
    let number = |digits: &str| digits.parse().ok().filter(|n| *n <= MOST_DIGITS);
    let wrong = || format!("`{{{text}}}`: expected a name, with a form as in {{seconds:.2}} or {{frame:04}}");
    if name.trim().is_empty() {
        return Err(wrong());
    }
    let form = Form {
        width: if width.is_empty() { 0 } else { number(width).ok_or_else(wrong)? },
        decimals: decimals.map(|digits| number(digits).ok_or_else(wrong)).transpose()?,
    };
    Ok(LabelPiece::Name { name: name.trim().to_string(), form })
}

impl Form {
    /// What is no number is written as it is.
    fn write(self, value: &str, out: &mut String) {
        let Form { width, decimals } = self;
        let written = match (value.parse::<f64>(), decimals) {
            (Ok(number), Some(decimals)) => write!(out, "{number:0width$.decimals$}"),
            (Ok(_), None) => write!(out, "{value:0>width$}"),
            (Err(_), _) => write!(out, "{value}"),
        };
        // Writing to a text cannot fail.
        debug_assert!(written.is_ok());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(template: &str) -> Result<String, String> {
        let value = |name: &str, value: &str| (name.to_string(), value.to_string());
        let values =
            [value("frame", "7"), value("seconds", "0.291666"), value("lens", "Disk"), value("aperture", "0.1")];
        LabelTemplate::parse(template)?.fill(&values)
    }

    #[test]
    fn names_become_their_values_in_the_form_that_is_asked_for() {
        assert_eq!(filled("{frame} {seconds:.2} {aperture}").unwrap(), "7 0.29 0.1");
        assert_eq!(filled("#{frame:04}, {lens:.2} {seconds:06.2}").unwrap(), "#0007, Disk 000.29");
        assert_eq!(filled("{{{frame}}}").unwrap(), "{7}");
        assert_eq!(filled("").unwrap(), "");
        assert!(LabelTemplate::parse("").unwrap().is_empty());
    }

    #[test]
    fn mistakes_are_explained() {
        assert!(filled("{apreture}").unwrap_err().contains("did you mean `aperture`?"));
        for (wrong, word) in [("{frame", "stands alone"), ("frame}", "stands alone"), ("{}", "expected a name")] {
            assert!(filled(wrong).unwrap_err().contains(word), "{wrong}");
        }
        for wrong in ["{frame:x}", "{frame:.999}", "{frame:.}", "{:04}"] {
            assert!(filled(wrong).unwrap_err().contains("{seconds:.2}"), "{wrong}");
        }
    }
}
