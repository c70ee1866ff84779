//! Making new pictures golden: all at once, or one by one.

use std::io::{BufRead, Write};

use super::results::{GoldenResult, Outcome};
use super::{GoldenPatterns, TestArguments, Tested, shown, tell};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::cli::{print, say, usage};
use crate::compare::golden::{self, GoldenPicture};

/// Whether accepting changes anything: it failed, or the golden was made from something else.
fn is_open(result: &GoldenResult) -> bool {
    match result.outcome {
        Outcome::Different | Outcome::Missing | Outcome::Equal => true,
        Outcome::Unchanged | Outcome::Within | Outcome::Failed(_) | Outcome::Accepted => false,
    }
}

/// Makes golden what the patterns match. Of equal pictures only what they say of their making changes.
///
/// # Errors
/// A pattern that matches nothing; a file that cannot be written.
pub fn accept(tested: &mut [Tested], patterns: &GoldenPatterns, text: &str) -> Result<(), Diagnostics> {
    let matching = |result: &GoldenResult| patterns.matches(&result.name, result.frame.max(1));
    if !tested.iter().flat_map(|tested| &tested.results).any(matching) {
        let known = tested.iter().flat_map(|tested| &tested.results).map(|result| result.name.as_str());
        let mut names: Vec<&str> = known.collect();
        names.dedup();
        let problem = Diagnostic::error(format!("--accept {text}: no golden is called so")).suggest(text, names);
        return Err(problem.because(Cause::Usage).into());
    }
    for result in tested.iter_mut().flat_map(|tested| &mut tested.results) {
        // What is forgiven changes only if it is named: goldens that creep along would forgive anything in the end.
        let is_named = text != "*" && matches!(result.outcome, Outcome::Within);
        if matching(result) && (is_open(result) || is_named) {
            make_golden(result)?;
        }
    }
    Ok(())
}

fn make_golden(result: &mut GoldenResult) -> Result<(), Diagnostics> {
    let Some(new) = &result.new else { return Ok(()) };
    golden::write(&result.golden, &GoldenPicture::read(new)?, result.description.as_deref())?;
    result.outcome = Outcome::Accepted;
    result.item = None;
    Ok(())
}

/// Shows what fails one by one and asks what is right.
///
/// # Errors
/// A file that cannot be written.
pub fn review(tested: &mut [Tested]) -> Result<(), Diagnostics> {
    let results = || tested.iter().flat_map(|tested| &tested.results);
    let total = results().filter(|result| result.outcome.fails()).count();
    let open = results().filter(|result| can_be_accepted(result)).count();
    if open < total {
        say(&Diagnostic::warning(format!("{} cannot be accepted: they failed", total - open)).into());
    }
    if open == 0 {
        print("nothing to review\n");
        return Ok(());
    }
    let mut input = std::io::stdin().lock();
    let mut all = false;
    let mut at = 0;
    for result in tested.iter_mut().flat_map(|tested| &mut tested.results).filter(|result| can_be_accepted(result)) {
        at += 1;
        if !all {
            print(&told(result, at, open));
        }
        let answer = if all { Answer::Accept } else { ask(&mut input)? };
        match answer {
            Answer::Accept => make_golden(result)?,
            Answer::All => {
                all = true;
                make_golden(result)?;
            }
            Answer::Reject => {}
            Answer::Quit => break,
        }
    }
    Ok(())
}

fn can_be_accepted(result: &GoldenResult) -> bool {
    matches!(result.outcome, Outcome::Different | Outcome::Missing)
}

fn told(result: &GoldenResult, at: usize, open: usize) -> String {
    let mut text = format!("\n[{at}/{open}] {}: {}\n", result.id(), result.outcome.word());
    let lines = result.lines.iter().cloned().chain(result.why.iter().map(|change| format!("why: {change}")));
    lines.for_each(|line| text += &format!("  {line}\n"));
    if result.golden.exists() {
        text += &format!("  golden  {}\n", shown(&result.golden));
    }
    if let Some(new) = &result.new {
        text += &format!("  now     {}\n", shown(new));
    }
    text
}

enum Answer {
    Accept,
    Reject,
    /// This one and all that follow.
    All,
    Quit,
}

/// Asks until there is an answer; the end of the input is the end of the review.
fn ask(input: &mut impl BufRead) -> Result<Answer, Diagnostics> {
    loop {
        print("a accept, r reject, A accept all that are left, q quit > ");
        let _ = std::io::stdout().flush();
        let mut line = String::new();
        let read = input.read_line(&mut line).map_err(|e| usage(format!("--review: cannot read the answer: {e}")))?;
        if read == 0 {
            print("\n");
            return Ok(Answer::Quit);
        }
        match line.trim() {
            "a" | "accept" | "y" => return Ok(Answer::Accept),
            "r" | "reject" | "n" | "s" => return Ok(Answer::Reject),
            "A" | "all" => return Ok(Answer::All),
            "q" | "quit" => return Ok(Answer::Quit),
            other => print(&format!("`{other}` is none of these\n")),
        }
    }
}

/// Removes goldens that nothing names; pictures that anim did not write are left alone.
///
/// # Errors
/// A file that cannot be removed.
pub fn prune(tested: &mut [Tested], arguments: &TestArguments) -> Result<(), Diagnostics> {
    for path in tested.iter_mut().flat_map(|tested| std::mem::take(&mut tested.unnamed)) {
        if golden::hash_of(&path).is_none() {
            let message = format!("{} was not made by anim, and is left alone", shown(&path));
            say(&Diagnostic::warning(message).into());
            continue;
        }
        std::fs::remove_file(&path).map_err(|e| Diagnostic::io(path.display(), "remove", &e))?;
        tell(arguments, &format!("removed {}", shown(&path)));
    }
    Ok(())
}
