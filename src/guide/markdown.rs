//! Pages that are kept as Markdown, for those who read them in the repository too.
//!
//! What such a page may have is what [`Block`] has: a title, headings, paragraphs, fenced code and tables of two columns.

use super::{Block, CodeKind};

/// The pieces of a page, without its title.
pub fn blocks(source: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut paragraph: Vec<&str> = Vec::new();
    let mut lines = source.lines().peekable();
    while let Some(line) = lines.next() {
        let ends_paragraph = line.is_empty() || line.starts_with(['#', '|']) || line.starts_with(FENCE);
        if ends_paragraph && !paragraph.is_empty() {
            blocks.push(Block::Paragraph(paragraph.join(" ").replace("**", "")));
            paragraph.clear();
        }
        if let Some(language) = line.strip_prefix(FENCE) {
            let code: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with(FENCE)).collect();
            blocks.push(Block::Code(kind_of(language), code.join("\n")));
        } else if let Some(heading) = line.strip_prefix("## ") {
            blocks.push(Block::Heading(heading.into()));
        } else if line.starts_with('|') {
            // The first row names the columns if a ruler follows; the pairs below speak for themselves.
            if lines.next_if(|next| next.starts_with("|--") || next.starts_with("| --")).is_none() {
                blocks.extend(pair(line));
            }
        } else if !ends_paragraph {
            paragraph.push(line.trim_start());
        }
    }
    if !paragraph.is_empty() {
        blocks.push(Block::Paragraph(paragraph.join(" ").replace("**", "")));
    }
    blocks
}

/// What stands around code.
const FENCE: &str = "```";

fn kind_of(language: &str) -> CodeKind {
    match language {
        "sh" => CodeKind::Command,
        "rhai" => CodeKind::Script,
        "scene" => CodeKind::Scene,
        _ => CodeKind::Answer,
    }
}

/// A row of a table of two columns.
fn pair(row: &str) -> Option<Block> {
    let (left, right) = row.trim_matches(['|', ' ']).split_once(" | ")?;
    Some(Block::Pair(left.trim().into(), right.trim().into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_of_a_page_becomes_a_block() {
        let source = "# Title\n\nTwo **lines**\nof text.\n\n## A heading\n\n```sh\nanim test\n\nanim guide\n```\n\n\
                      | field | what |\n|---|---|\n| `max` | steps |\n| `flip` | an error |\nThe end.\n";
        let text = |text: &str| Block::Paragraph(text.into());
        let pair = |left: &str, right: &str| Block::Pair(left.into(), right.into());
        assert_eq!(
            blocks(source),
            [
                text("Two lines of text."),
                Block::Heading("A heading".into()),
                Block::Code(CodeKind::Command, "anim test\n\nanim guide".into()),
                pair("`max`", "steps"),
                pair("`flip`", "an error"),
                text("The end."),
            ]
        );
    }
}
