//! Words that survive the shells and tools that jobs are written for, blanks and quotes in them included.

/// A word for a POSIX shell.
pub fn shell(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-=+:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_string();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Words for a POSIX shell, side by side.
pub fn shell_words<'a>(words: impl IntoIterator<Item = &'a String>) -> String {
    words.into_iter().map(|word| shell(word)).collect::<Vec<_>>().join(" ")
}

/// A word for PowerShell, in ASCII: Windows PowerShell reads a script without a byte order mark in the code page of its
/// machine.
pub fn power_shell(word: &str) -> String {
    let mut quoted = String::from("'");
    for unit in word.encode_utf16() {
        match char::from_u32(unit.into()).filter(char::is_ascii) {
            // The two marks of a quote.
            Some('\'') => quoted += "''",
            Some(c) => quoted.push(c),
            None => quoted += &format!("' + [char]{unit} + '"),
        }
    }
    quoted.push('\'');
    if word.is_ascii() { quoted } else { format!("({quoted})") }
}

/// A shell command as a recipe of make.
pub fn make_recipe(command: &str) -> String {
    command.replace('$', "$$")
}

/// A path as a target or a prerequisite of make.
pub fn make_path(path: &str) -> String {
    let escaped = |c: char| match c {
        ' ' | '#' | ':' | '%' => format!("\\{c}"),
        '$' => "$$".to_string(),
        c => c.to_string(),
    };
    path.chars().map(escaped).collect()
}

/// A shell command in a ninja file.
pub fn ninja(text: &str) -> String {
    text.replace('$', "$$")
}

/// A path in a ninja file.
pub fn ninja_path(path: &str) -> String {
    ninja(path).replace(' ', "$ ").replace(':', "$:")
}

/// A text in YAML, between double quotes, which are those of JSON.
pub fn yaml(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_words_that_were_written() {
        for word in
            ["plain", "", "two words", "it's", "$HOME `x` \\ \"q\"", "a\nb", "-D", "*?[a]", "~", "ü", "a;b|c&d>e"]
        {
            let script = format!("printf %s {}", shell(word));
            let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
            assert_eq!(String::from_utf8_lossy(&output.stdout), word);
        }
    }

    #[test]
    fn other_tools_have_their_own_signs() {
        assert_eq!(power_shell("it's $x"), "'it''s $x'");
        assert_eq!(power_shell("a=ü"), "('a=' + [char]252 + '')");
        assert_eq!((make_recipe("echo $x"), make_path("a b:c")), ("echo $$x".into(), "a\\ b\\:c".into()));
        assert_eq!(ninja_path("a b:$c"), "a$ b$:$$c");
        assert_eq!(yaml("a \"b\"\n{c}"), "\"a \\\"b\\\"\\n{c}\"");
    }
}
