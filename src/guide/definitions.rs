//! Functions of scripts as a definition file for the language server of Rhai.

use crate::script::CHAPTERS;

/// The file's name.
pub const FILE: &str = "anim.d.rhai";

/// What an argument or a result is called by the language server.
fn type_word(word: &str) -> &'static str {
    match word.trim() {
        "number" => "float",
        "whole number" => "int",
        "text" => "String",
        "bool" => "bool",
        "map" => "map",
        word if word.starts_with("list") => "array",
        "vector" | "rotation" => "Vec3",
        "path" => "Path",
        "mesh" => "Mesh",
        "entity" => "Entity",
        "component" => "Component",
        "camera" => "Camera",
        "cameras" => "Cameras",
        "generator" => "Random",
        "table" => "Table",
        _ => "?",
    }
}

/// All functions with their texts.
pub fn file() -> String {
    let mut out = String::from("module static;\n");
    for chapter in CHAPTERS {
        out += &format!("\n// {}\n", chapter.title);
        for function in chapter.functions {
            for form in function.forms {
                let (call, result) = form.split_once(" -> ").unwrap_or((form, "()"));
                let (receiver, call) = match call.split_once('.') {
                    Some((receiver, call)) => (Some(receiver), call),
                    None => (None, call),
                };
                out += "\n";
                function.text.lines().for_each(|line| out += &format!("/// {line}\n"));
                for (name, text) in function.arguments {
                    out += &format!("/// - `{name}`: {text}\n");
                }
                let Some((name, arguments)) = call.split_once('(') else {
                    let receiver = receiver.unwrap_or("value");
                    out += &format!("fn get ${call}({receiver}: ?) -> {};\n", type_word(result));
                    continue;
                };
                let arguments = arguments.trim_end_matches(')').split(", ").filter(|one| !one.is_empty());
                let all: Vec<String> = receiver.into_iter().chain(arguments).map(|one| format!("{one}: ?")).collect();
                out += &format!("fn {name}({}) -> {};\n", all.join(", "), type_word(result));
            }
        }
    }
    out
}
