//! What Rhai's grammar lacks, written in terms of what it has, before a script is compiled.
//!
//! - `s.get("hero").yaw = 90` is an assignment, and Rhai allows none to what a call returns: where one follows, `.get(...)`
//!   and `.material(...)` become the index expressions `.get[...]` and `.material[...]`. The rule looks at the assignment,
//!   not at the name of what holds the scene.
//! - A list takes any whole number as its index, 4.0 too: what stands between the brackets goes through a function.
//! - `x /= y` is `x = x / y`: Rhai's own would cut the fraction off between whole numbers.
//! - What `catch (e)` catches goes through a function, which takes out of it what differs from machine to machine.
//! - A closure that is written out in a text, as in `${|x| x}`, is kept from the parser, which would put its name there.
//!
//! - Constants of a module's top are exported: `const K = 3;` is `export const K = 3;`.
//!
//! Lines stay as they are; columns that move are known and told back in messages.

use ::rhai::{AST, Engine, ParseError, Position, Token};

use super::closures::{CAUGHT, NOTHING};

/// The function around an index, see [`super::engine`].
pub const INDEX: &str = "anim_index";
/// What `/` is inside the engine, which would turn `x = x / y` into its own `x /= y` otherwise.
pub const DIVIDE: &str = "anim_divide";

/// A script as the engine compiles it, with the way back to what its author wrote.
#[derive(Clone, Debug, Default)]
pub struct Rewritten {
    pub text: String,
    /// Line, column in the original, characters taken out there and put in, in the order of places.
    changes: Vec<(usize, usize, usize, usize)>,
}

impl Rewritten {
    /// The place in the original of a place in the rewritten text; lines and columns count from 1.
    pub fn original(&self, line: usize, column: usize) -> (usize, usize) {
        // Columns put in so far, less those taken out.
        let mut shift = 0isize;
        for (_, at, out, put) in self.changes.iter().filter(|change| change.0 == line) {
            let start = at.saturating_add_signed(shift);
            if column < start {
                break;
            }
            if column < start + put {
                return (line, *at);
            }
            shift += *put as isize - *out as isize;
        }
        (line, column.saturating_add_signed(-shift).max(1))
    }
}

/// One token with its place.
pub type PlacedToken = (Token, Position);

/// The tokens of a text; what cannot be read ends the list with an error token.
pub fn tokens(engine: &Engine, text: &str) -> Vec<PlacedToken> {
    let inputs = [text];
    let (stream, control) = engine.lex(&inputs);
    let mut all = Vec::new();
    // For each interpolated string that is open, how many braces are open inside of its `${ }`.
    let mut inside: Vec<usize> = Vec::new();
    for (token, at) in stream {
        match &token {
            Token::InterpolatedString(..) => inside.push(0),
            Token::LeftBrace | Token::MapStart => {
                if let Some(depth) = inside.last_mut() {
                    *depth += 1;
                }
            }
            Token::RightBrace => {
                if let Some(depth) = inside.last_mut() {
                    *depth = depth.saturating_sub(1);
                    if *depth == 0 {
                        // What follows is text again: the rest of the string, or up to its next `${`.
                        inside.pop();
                        control.borrow_mut().is_within_text = true;
                    }
                }
            }
            _ => {}
        }
        let ends = matches!(token, Token::EOF | Token::LexError(..));
        all.push((token, at));
        if ends {
            break;
        }
    }
    all
}

/// Compiles a script or module after rewriting it.
///
/// # Errors
/// What the parser says, at its place in the rewritten text.
pub fn compile(engine: &Engine, text: &str, role: TextRole) -> (Result<AST, ParseError>, Rewritten) {
    let rewritten = rewrite(engine, text, role);
    (engine.compile(&rewritten.text), rewritten)
}

/// What a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextRole {
    /// The script itself.
    Script,
    /// One that it imports.
    Module,
}

/// A change: the token that it is at, characters to take out from there, and what to put in before.
struct TextChange {
    at: Position,
    out: usize,
    put: String,
}

fn rewrite(engine: &Engine, text: &str, role: TextRole) -> Rewritten {
    let tokens = tokens(engine, text);
    let partners = partners(&tokens);
    let starts = line_starts(text);
    let mut changes = Vec::new();
    if role == TextRole::Module {
        export_constants(&tokens, &mut changes);
    }
    for i in 0..tokens.len() {
        lookup(&tokens, &partners, i, &mut changes);
        index(&tokens, &partners, i, &mut changes);
        divide_assign(&tokens, &partners, i, text, &starts, &mut changes);
        catch(&tokens, i, &mut changes);
        closure_in_text(&tokens, &partners, i, &mut changes);
    }
    changes.sort_by_key(|change| (change.at.line(), change.at.position()));
    apply(text, &starts, changes)
}

/// For each bracket the one that belongs to it.
pub fn partners(tokens: &[PlacedToken]) -> Vec<Option<usize>> {
    let mut partners = vec![None; tokens.len()];
    let mut open = Vec::new();
    for (i, (token, _)) in tokens.iter().enumerate() {
        match token {
            Token::LeftParen | Token::LeftBracket | Token::LeftBrace | Token::MapStart | Token::QuestionBracket => {
                open.push(i);
            }
            Token::RightParen | Token::RightBracket | Token::RightBrace => {
                if let Some(start) = open.pop() {
                    partners[start] = Some(i);
                    partners[i] = Some(start);
                }
            }
            _ => {}
        }
    }
    partners
}

fn is_assignment(token: &Token) -> bool {
    matches!(token, Token::Equals) || token.is_op_assignment()
}

/// `.get(...)` or `.material(...)` that something is assigned to.
fn lookup(tokens: &[PlacedToken], partners: &[Option<usize>], i: usize, changes: &mut Vec<TextChange>) {
    let [(Token::Period, _), (Token::Identifier(name), _), (Token::LeftParen, open), ..] = &tokens[i..] else { return };
    if !["get", "material"].contains(&name.as_str()) {
        return;
    }
    let Some(close) = partners[i + 2] else { return };
    let mut at = close + 1;
    let first = at;
    loop {
        match tokens.get(at).map(|(token, _)| token) {
            Some(Token::Period) => at += 2,
            Some(Token::LeftBracket | Token::LeftParen) => match partners[at] {
                Some(end) => at = end + 1,
                None => return,
            },
            Some(token) if at > first && is_assignment(token) => break,
            _ => return,
        }
    }
    changes.push(TextChange { at: *open, out: 1, put: "[".into() });
    changes.push(TextChange { at: tokens[close].1, out: 1, put: "]".into() });
}

/// Constants of a module's top are there for whoever imports it, as its functions are.
fn export_constants(tokens: &[PlacedToken], changes: &mut Vec<TextChange>) {
    let mut depth = 0usize;
    for (i, (token, at)) in tokens.iter().enumerate() {
        match token {
            Token::LeftBrace | Token::MapStart => depth += 1,
            Token::RightBrace => depth = depth.saturating_sub(1),
            Token::Const if depth == 0 && !(i > 0 && tokens[i - 1].0 == Token::Export) => {
                changes.push(TextChange { at: *at, out: 0, put: "export ".into() });
            }
            _ => {}
        }
    }
}

/// Whether an expression may end with this token, so that a bracket behind it is an index.
fn ends_value(token: &Token) -> bool {
    match token {
        Token::Identifier(_) | Token::RightParen | Token::RightBracket => true,
        Token::StringConstant(_) => true,
        Token::Reserved(word) => **word == "this",
        _ => false,
    }
}

/// An index that is more than a number or a text.
fn index(tokens: &[PlacedToken], partners: &[Option<usize>], i: usize, changes: &mut Vec<TextChange>) {
    let is_index = match tokens[i].0 {
        Token::LeftBracket => i > 0 && ends_value(&tokens[i - 1].0),
        Token::QuestionBracket => true,
        _ => false,
    };
    let Some(close) = partners[i].filter(|_| is_index) else { return };
    let content = &tokens[i + 1..close];
    let is_constant = matches!(content, [(Token::IntegerConstant(_) | Token::StringConstant(_), _)]);
    let is_range = content.iter().any(|(token, _)| matches!(token, Token::ExclusiveRange | Token::InclusiveRange));
    if content.is_empty() || is_constant || is_range {
        return;
    }
    changes.push(TextChange { at: content[0].1, out: 0, put: format!("{INDEX}(") });
    changes.push(TextChange { at: tokens[close].1, out: 0, put: ")".into() });
}

/// `target /= value` on one line.
fn divide_assign(
    tokens: &[PlacedToken],
    partners: &[Option<usize>],
    i: usize,
    text: &str,
    starts: &[usize],
    changes: &mut Vec<TextChange>,
) {
    if tokens[i].0 != Token::DivideAssign || i == 0 {
        return;
    }
    let mut first = i - 1;
    loop {
        if let Token::RightBracket | Token::RightParen = tokens[first].0 {
            match partners[first] {
                Some(open) if open > 0 => first = open - 1,
                _ => return,
            }
            continue;
        }
        match first.checked_sub(1).map(|before| &tokens[before].0) {
            Some(Token::Period) if first >= 2 => first -= 2,
            _ => break,
        }
    }
    let mut end = i + 1;
    while let Some((token, _)) = tokens.get(end) {
        match token {
            Token::SemiColon | Token::RightBrace | Token::RightParen | Token::Comma | Token::EOF => break,
            Token::LeftParen | Token::LeftBracket | Token::LeftBrace | Token::MapStart | Token::QuestionBracket => {
                match partners[end] {
                    Some(close) => end = close + 1,
                    None => return,
                }
            }
            _ => end += 1,
        }
    }
    let Some((_, close)) = tokens.get(end) else { return };
    let (from, to) = (offset(text, starts, tokens[first].1), offset(text, starts, tokens[i].1));
    let target = text[from..to].trim_end();
    if target.contains('\n') {
        return;
    }
    changes.push(TextChange { at: tokens[i].1, out: 2, put: format!("= {target} /") });
    changes.push(TextChange { at: tokens[i + 1].1, out: 0, put: "(".into() });
    changes.push(TextChange { at: *close, out: 0, put: ")".into() });
}

/// `catch (name) { ...`.
fn catch(tokens: &[PlacedToken], i: usize, changes: &mut Vec<TextChange>) {
    use Token::{Catch, Identifier, LeftBrace, LeftParen, RightParen};
    let [(Catch, _), (LeftParen, _), (Identifier(name), _), (RightParen, _), (LeftBrace, _), (next, first), ..] =
        &tokens[i..]
    else {
        return;
    };
    if !matches!(next, Token::EOF | Token::LexError(_)) {
        changes.push(TextChange { at: *first, out: 0, put: format!("{name} = {CAUGHT}({name}); ") });
    }
}

/// `${ ... }` with something in it that may be a closure.
fn closure_in_text(tokens: &[PlacedToken], partners: &[Option<usize>], i: usize, changes: &mut Vec<TextChange>) {
    let [(Token::InterpolatedString(_), _), (Token::LeftBrace, _), (_, first), ..] = &tokens[i..] else { return };
    let Some(close) = partners[i + 1] else { return };
    let has_closure = tokens[i + 2..close].iter().any(|(token, _)| matches!(token, Token::Pipe | Token::Or));
    if has_closure {
        changes.push(TextChange { at: *first, out: 0, put: format!("{NOTHING}(); ") });
    }
}

pub fn line_starts(text: &str) -> Vec<usize> {
    [0].into_iter().chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect()
}

/// Where in a text a place is; its end for places behind it.
pub fn offset(text: &str, starts: &[usize], at: Position) -> usize {
    let Some(start) = at.line().and_then(|line| starts.get(line - 1)) else { return text.len() };
    let rest = &text[*start..];
    start + rest.char_indices().nth(at.position().unwrap_or(1).max(1) - 1).map_or(rest.len(), |(i, _)| i)
}

fn apply(text: &str, starts: &[usize], changes: Vec<TextChange>) -> Rewritten {
    let mut out = Rewritten::default();
    let mut done = 0;
    for change in changes {
        let at = offset(text, starts, change.at);
        if at < done {
            continue;
        }
        out.text.push_str(&text[done..at]);
        out.text.push_str(&change.put);
        done = text[at..].char_indices().nth(change.out).map_or(text.len(), |(i, _)| at + i);
        let (line, column) = (change.at.line().unwrap_or(0), change.at.position().unwrap_or(1));
        out.changes.push((line, column, change.out, change.put.chars().count()));
    }
    out.text.push_str(&text[done..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rewritten(text: &str) -> String {
        rewrite(&Engine::new_raw(), text, TextRole::Script).text
    }

    #[test]
    fn constants_of_a_modules_top_are_exported() {
        let text = "const A = 1; export const B = 2;\nfn f() { const C = 3; C }";
        let module = rewrite(&Engine::new_raw(), text, TextRole::Module);
        assert_eq!(module.text, format!("export {text}"));
        assert_eq!(module.original(1, 14), (1, 7));
        assert_eq!(rewritten(text), text);
    }

    #[test]
    fn lookups_become_indices_only_where_something_is_assigned() {
        assert_eq!(rewritten("s.get(\"a\").yaw = 3;"), "s.get[\"a\"].yaw = 3;");
        assert_eq!(rewritten("stage.get(name(1)).a.b.c += 3;"), "stage.get[name(1)].a.b.c += 3;");
        assert_eq!(rewritten("x.material(\"m\").c[0] = 1;"), "x.material[\"m\"].c[0] = 1;");
        for same in ["let a = s.get(\"a\").yaw;", "if s.get(\"a\").yaw == 3 { }", "m.get(\"a\");", "get(\"a\") = 3;"] {
            assert_eq!(rewritten(same), same);
        }
        assert_eq!(rewritten("s.get(s.get(\"b\").name).yaw = 1;"), "s.get[s.get(\"b\").name].yaw = 1;");
        let text = "s.get(`a ${b} c ${d}`).yaw = 1; s.get(\"z\").x = 2;";
        assert_eq!(rewritten(text), "s.get[`a ${b} c ${d}`].yaw = 1; s.get[\"z\"].x = 2;");
    }

    #[test]
    fn indices_go_through_a_function_unless_they_are_constant() {
        assert_eq!(
            rewritten("a[i] + a[0] + [1, 2] + m[\"k\"] + a[i + 1][j]"),
            "a[anim_index(i)] + a[0] + [1, 2] + m[\"k\"] + a[anim_index(i + 1)][anim_index(j)]"
        );
        assert_eq!(rewritten("a[2..n]"), "a[2..n]");
        assert_eq!(rewritten("let x = [a, b];"), "let x = [a, b];");
    }

    #[test]
    fn divisions_in_place_are_written_out() {
        assert_eq!(rewritten("x /= 2;"), "x = x / (2);");
        assert_eq!(rewritten("s.a[1].b /= c + f(1, 2); y"), "s.a[1].b = s.a[1].b / (c + f(1, 2)); y");
        assert_eq!(rewritten("if x { v /= 2 }"), "if x { v = v / (2 )}");
    }

    #[test]
    fn what_is_caught_goes_through_a_function() {
        let put = "e = anim_caught(e); ";
        assert_eq!(
            rewritten("try { f(1); } catch (e) { g(e); }"),
            format!("try {{ f(1); }} catch (e) {{ {put}g(e); }}")
        );
        assert_eq!(rewritten("try { } catch(e) { }"), format!("try {{ }} catch(e) {{ {put}}}"));
        for same in ["try { f(1); } catch { g(1); }", "catch (", "catch (e) {", "catch (e, f) { }"] {
            assert_eq!(rewritten(same), same);
        }
    }

    #[test]
    fn closures_in_texts_are_no_constants() {
        assert_eq!(rewritten("`a ${|x| x} b`"), "`a ${anim_nothing(); |x| x} b`");
        for same in ["`a ${x} b`", "`${a + 1}${[1]}`", "let c = |x| `${x}`;"] {
            assert_eq!(rewritten(same), same);
        }
    }

    #[test]
    fn places_are_told_back() {
        let text = "let a = 1;\nb[i] /= c.d; e\nf";
        let rewritten = rewrite(&Engine::new_raw(), text, TextRole::Script);
        assert_eq!(rewritten.text, "let a = 1;\nb[anim_index(i)] = b[i] / (c.d); e\nf");
        for (word, line, column) in [("= b", 2, 6), ("c.d", 2, 9), ("; e", 2, 12), ("i)", 2, 3)] {
            let at = rewritten.text.lines().nth(line - 1).unwrap().find(word).unwrap() + 1;
            let found = rewritten.original(line, at);
            assert_eq!(found, (line, column), "{word}");
        }
        assert_eq!(rewritten.original(3, 1), (3, 1));
    }

    #[test]
    fn what_cannot_be_read_stays_as_it_is() {
        for text in ["\"", "a[", "`${", "`${|", "/*", "a[i", "x /=", "/= 2", "é[ü]", "'abc'[i]", "catch (e) {"] {
            let _ = rewrite(&Engine::new_raw(), text, TextRole::Script);
        }
        assert_eq!(rewritten("é[ü] = 1"), "é[ü] = 1");
    }
}
