//! Which goldens are meant: `show`, `show.3`, `show.1-12`, `sh*`, several with commas between them.

/// Patterns, of which one must match.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GoldenPatterns(Vec<GoldenPattern>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct GoldenPattern {
    /// What the name must look like; `*` stands for anything.
    name: String,
    /// First and last frame.
    frames: Option<[u32; 2]>,
}

impl GoldenPatterns {
    /// Reads patterns.
    ///
    /// # Errors
    /// What is wrong with one of them.
    pub fn parse(text: &str) -> Result<GoldenPatterns, String> {
        let patterns = text.split(',').map(|part| pattern(part.trim())).collect::<Result<Vec<_>, _>>()?;
        Ok(GoldenPatterns(patterns))
    }

    /// Whether a golden is meant, by the name of its entry and its frame.
    pub fn matches(&self, name: &str, frame: u32) -> bool {
        self.0.iter().any(|pattern| {
            let in_range = pattern.frames.is_none_or(|[from, to]| (from..=to).contains(&frame));
            in_range && is_like(name, &pattern.name)
        })
    }

    /// Whether an entry may hold a golden that is meant.
    pub fn touches(&self, name: &str) -> bool {
        self.0.iter().any(|pattern| is_like(name, &pattern.name))
    }
}

fn pattern(text: &str) -> Result<GoldenPattern, String> {
    if text.is_empty() {
        return Err("a pattern is empty; write show, show.3 or 'show.*'".into());
    }
    let bare = text.strip_suffix(".png").unwrap_or(text);
    let Some((name, last)) = bare.rsplit_once('.') else {
        return Ok(GoldenPattern { name: bare.to_string(), frames: None });
    };
    if last == "*" {
        return Ok(GoldenPattern { name: name.to_string(), frames: None });
    }
    let number = |text: &str| {
        let is_plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        is_plain.then(|| text.parse::<u32>().ok()).flatten()
    };
    let range = match last.split_once('-') {
        Some((from, to)) => number(from).zip(number(to)),
        None => number(last).map(|n| (n, n)),
    };
    match range {
        Some((from, to)) if from > to => Err(format!("`{text}`: the range runs backwards; write {to}-{from}")),
        Some((from, to)) => Ok(GoldenPattern { name: name.to_string(), frames: Some([from, to]) }),
        // A name may have a dot in it.
        None => Ok(GoldenPattern { name: bare.to_string(), frames: None }),
    }
}

/// Whether a name looks like a pattern, in which `*` stands for any letters.
fn is_like(name: &str, pattern: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or("");
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let parts: Vec<&str> = parts.collect();
    let Some((last, middle)) = parts.split_last() else { return rest.is_empty() };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(pattern: &str, name: &str, frame: u32) -> bool {
        GoldenPatterns::parse(pattern).unwrap().matches(name, frame)
    }

    #[test]
    fn names_frames_and_stars() {
        assert!(matches("*", "show", 1) && matches("show", "show", 9) && matches("sh*", "show", 9));
        assert!(matches("show.0003", "show", 3) && matches("show.3.png", "show", 3) && !matches("show.3", "show", 4));
        assert!(matches("show.2-4", "show", 2) && matches("show.2-4", "show", 4) && !matches("show.2-4", "show", 5));
        assert!(matches("show.*", "show", 7) && matches("a,b.2, c", "b", 2) && !matches("a,b.2,c", "b", 1));
        assert!(matches("v1.5", "v1", 5) && matches("v1.x", "v1.x", 5) && matches("*o*w", "show", 1));
        assert!(!matches("sho", "show", 1) && !matches("*x*", "show", 1) && !matches("show*show", "show", 1));
        assert!(GoldenPatterns::parse("").is_err() && GoldenPatterns::parse("a,,b").is_err());
        assert!(GoldenPatterns::parse("show.4-2").unwrap_err().contains("2-4"));
        assert!(GoldenPatterns::parse("show.99999999999").unwrap().matches("show.99999999999", 1));
    }
}
