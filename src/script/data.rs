//! Data from files: tables of CSV, values of JSON, plain text; below the project root, with every mistake at its place in
//! the file.

use std::path::Path;
use std::sync::Arc;

use ::rhai::{Array, Dynamic, ImmutableString, Map};

use super::context::ScriptContext;
use super::convert::{describe, number};
use super::csv_text::{CsvColumns, CsvText};
use super::errors::{Fallible, complain, complain_at};
use super::options::CallOptions;
use super::table::{Chapter, Function};
use crate::base::diagnostics::{Diagnostic, Place, suggestion};
use crate::base::project::FileRole;
use crate::base::{files, limits};

/// A table of typed columns, as a script holds it: copies share it.
#[derive(Clone)]
pub struct DataTable(Arc<CsvColumns>);

/// The text of a file that a script names, without a byte order mark, and the file as messages call it.
fn read(function: &str, name: &str) -> Fallible<(Arc<str>, String)> {
    let shared = ScriptContext::current(function)?;
    let Some(folder) = shared.folder() else { return complain(format!("`{function}` cannot be called here"), None) };
    let refuse = |problem: Diagnostic| complain(problem.message, problem.help);
    let path = match folder.find(name, FileRole::Data) {
        Ok(path) => path,
        Err(problem) => return refuse(problem),
    };
    let note = |bytes: &[u8]| folder.project().note_content(&path, FileRole::Data, bytes);
    let file: Arc<str> = path.to_string_lossy().into();
    if let Some(text) = shared.known_text(&file) {
        return Ok((file, text));
    }
    let bytes = match files::read_bytes(Path::new(&*file), limits::DATA_FILE_BYTES) {
        Ok(bytes) => bytes,
        Err(problem) => {
            note(&[]);
            return refuse(problem);
        }
    };
    note(&bytes);
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").map(<[u8]>::to_vec).unwrap_or(bytes);
    match String::from_utf8(bytes) {
        Ok(text) => {
            shared.keep_text(&file, &text);
            Ok((file, text))
        }
        Err(error) => {
            let valid = String::from_utf8_lossy(&error.as_bytes()[..error.utf8_error().valid_up_to()]).into_owned();
            let is_utf16 = error.as_bytes().starts_with(&[0xff, 0xfe]) || error.as_bytes().starts_with(&[0xfe, 0xff]);
            let encoding = if is_utf16 { "UTF-16" } else { "no UTF-8" };
            let place = Place::of_span(file, &valid, valid.len(), valid.len());
            complain_at(place, format!("this text is {encoding}"), Some("save it as UTF-8".into()))
        }
    }
}

fn load_csv(name: &str, options: &Map) -> Fallible<DataTable> {
    let options = CallOptions::new("load_csv", options, &["separator", "header", "types"])?;
    let separator = match options.get("separator") {
        None => b',',
        Some(value) => match value.clone().into_immutable_string().ok().as_deref().map(str::as_bytes) {
            Some([byte]) if byte.is_ascii() => *byte,
            Some(b"\\t" | b"tab") => b'\t',
            _ => return options.wrong("separator", "one sign, as \",\" or \";\"", value),
        },
    };
    let (file, text) = read("load_csv", name)?;
    let has_header = options.switch("header", true)?;
    let types = match options.get("types").map(|value| (value, value.read_lock::<Map>())) {
        None => Map::new(),
        Some((_, Some(map))) => map.clone(),
        Some((value, None)) => return options.wrong("types", "a map of columns and types", value),
    };
    let table = CsvText { file: &file, text: &text, separator }.read(has_header, &types)?;
    ScriptContext::current("load_csv")?.note_columns(&table.names);
    Ok(DataTable(Arc::new(table)))
}

impl DataTable {
    fn column_index(&self, name: &str) -> Fallible<usize> {
        match self.0.names.iter().position(|known| known == name) {
            Some(i) => Ok(i),
            None => {
                let known = self.0.names.iter().map(String::as_str);
                complain(format!("{} has no column `{name}`", self.0.file), suggestion(name, known))
            }
        }
    }

    fn row_index(&self, row: &Dynamic) -> Fallible<usize> {
        let count = self.0.rows as f64;
        match number(row)? {
            i if i == i.trunc() && (-count..count).contains(&i) => {
                Ok((i as i64).rem_euclid(self.0.rows as i64) as usize)
            }
            _ => complain(format!("{} has {} rows: there is no row {}", self.0.file, self.0.rows, describe(row)), None),
        }
    }

    fn row(&self, index: usize) -> Map {
        self.0
            .names
            .iter()
            .zip(&self.0.values)
            .map(|(name, column)| (name.as_str().into(), column[index].clone()))
            .collect()
    }

    fn column(&self, name: &str) -> Fallible<Array> {
        Ok(self.0.values[self.column_index(name)?].clone())
    }

    /// The numbers of a column that are there, with a fold over them.
    fn fold(&self, name: &str, start: f64, with: fn(f64, f64) -> f64) -> Fallible<f64> {
        let column = &self.0.values[self.column_index(name)?];
        column.iter().filter(|value| !value.is_unit()).try_fold(start, |so_far, value| Ok(with(so_far, number(value)?)))
    }
}

/// A value of JSON.
fn from_json(value: serde_json::Value) -> Dynamic {
    match value {
        serde_json::Value::Null => Dynamic::UNIT,
        serde_json::Value::Bool(b) => b.into(),
        serde_json::Value::Number(x) => match x.as_i64() {
            Some(whole) => whole.into(),
            None => x.as_f64().unwrap_or(0.0).into(),
        },
        serde_json::Value::String(text) => text.into(),
        serde_json::Value::Array(items) => items.into_iter().map(from_json).collect::<Array>().into(),
        serde_json::Value::Object(entries) => {
            entries.into_iter().map(|(key, value)| (key.into(), from_json(value))).collect::<Map>().into()
        }
    }
}

fn parse_json(text: &str, file: Option<Arc<str>>) -> Fallible<Dynamic> {
    match serde_json::from_str(text) {
        Ok(value) => Ok(from_json(value)),
        Err(error) => {
            let (line, column) = (error.line().max(1) as u32, error.column().max(1) as u32);
            let said = error.to_string();
            let message = format!("this is no JSON: {}", said.split(" at line ").next().unwrap_or(&said));
            match file {
                Some(file) => complain_at(Place::of_position(file, text, line, column), message, None),
                None => complain(format!("{message}, at line {line}, column {column} of the text"), None),
            }
        }
    }
}

const FILE: (&str, &str) = ("file", "a file beside the script or below its folder; never outside of the project");
const TABLE: (&str, &str) = ("data", "a table, as `load_csv` gives it");
const COLUMN: (&str, &str) = ("column", "the name of a column");

pub const CHAPTER: Chapter = Chapter {
    title: "Data",
    functions: &[
        Function {
            name: "load_csv",
            forms: &["load_csv(file) -> table", "load_csv(file, options) -> table"],
            text: "A table of a CSV file. A column of whole numbers, numbers or true and false holds these, any other one \
                   texts; what more than half of its values are, all must be. Empty values, NA, NaN and null are missing: \
                   (). `data[i]` is a row, a map by the names of the columns; `for row in data` goes through all; \
                   `data.column(name)` is a list. A table is read once, and its copies share it.",
            arguments: &[
                FILE,
                (
                    "options",
                    "a map: `separator`, one sign, default \",\"; `header`, whether the first row names the columns, default \
                     true (c1, c2, ... otherwise); `types`, a map of columns and what they hold: \"whole\", \"number\", \
                     \"bool\" or \"text\"",
                ),
            ],
            example: "// let data = load_csv(\"sensor.csv\");\n\
                      // s.get(\"bar\").scale = [1, data[f.index].level, 1];",
            register: |engine| {
                engine
                    .register_type_with_name::<DataTable>("Table")
                    .register_fn("load_csv", |file: &str| load_csv(file, &Map::new()))
                    .register_fn("load_csv", |file: &str, options: Map| load_csv(file, &options))
                    .register_indexer_get(|table: &mut DataTable, row: i64| -> Fallible<Map> {
                        Ok(table.row(table.row_index(&row.into())?))
                    })
                    .register_fn("to_string", |table: &mut DataTable| format!("table of {} rows", table.0.rows))
                    .register_fn("to_debug", |table: &mut DataTable| format!("table of {} rows", table.0.rows))
                    .register_iterator::<DataTable>();
            },
        },
        Function {
            name: "len",
            forms: &["data.len() -> whole number"],
            text: "How many rows a table has, or items a list, entries a map, letters a text.",
            arguments: &[("data", "a table, a list, a map or a text")],
            example: "[1, 2, 3].len()     // 3",
            register: |engine| {
                engine.register_fn("len", |table: &mut DataTable| table.0.rows as i64);
            },
        },
        Function {
            name: "columns",
            forms: &["data.columns -> list of texts"],
            text: "The names of a table's columns, in the order of the file.",
            arguments: &[TABLE],
            example: "// data.columns",
            register: |engine| {
                engine.register_get("columns", |table: &mut DataTable| -> Array {
                    table.0.names.iter().map(|name| ImmutableString::from(name.as_str()).into()).collect()
                });
            },
        },
        Function {
            name: "column",
            forms: &["data.column(column) -> list"],
            text: "The values of one column, () where one is missing.",
            arguments: &[TABLE, COLUMN],
            example: "// data.column(\"level\")",
            register: |engine| {
                engine.register_fn("column", |table: &mut DataTable, name: &str| table.column(name));
            },
        },
        Function {
            name: "value",
            forms: &["data.value(row, column) -> value"],
            text: "One value of a table; quicker than asking for the whole row.",
            arguments: &[TABLE, ("row", "counted from 0, or from -1, the last, down"), COLUMN],
            example: "// data.value(f.index, \"level\")",
            register: |engine| {
                engine.register_fn("value", |table: &mut DataTable, row: Dynamic, name: &str| -> Fallible<Dynamic> {
                    Ok(table.0.values[table.column_index(name)?][table.row_index(&row)?].clone())
                });
            },
        },
        Function {
            name: "lowest",
            forms: &["data.lowest(column) -> number"],
            text: "The least number of a column, missing ones left out; infinite if there is none.",
            arguments: &[TABLE, COLUMN],
            example: "// data.lowest(\"level\")",
            register: |engine| {
                engine.register_fn("lowest", |t: &mut DataTable, name: &str| t.fold(name, f64::INFINITY, f64::min));
            },
        },
        Function {
            name: "highest",
            forms: &["data.highest(column) -> number"],
            text: "The greatest number of a column, missing ones left out; minus infinite if there is none.",
            arguments: &[TABLE, COLUMN],
            example: "// data.highest(\"level\")",
            register: |engine| {
                engine
                    .register_fn("highest", |t: &mut DataTable, name: &str| t.fold(name, f64::NEG_INFINITY, f64::max));
            },
        },
        Function {
            name: "load_json",
            forms: &["load_json(file) -> value"],
            text: "What a JSON file holds: maps, lists, numbers, texts, true, false, and () for null.",
            arguments: &[FILE],
            example: "// let places = load_json(\"places.json\");",
            register: |engine| {
                engine.register_fn("load_json", |name: &str| -> Fallible<Dynamic> {
                    let (file, text) = read("load_json", name)?;
                    parse_json(&text, Some(file))
                });
            },
        },
        Function {
            name: "parse_json",
            forms: &["parse_json(text) -> value"],
            text: "What a text of JSON holds: any value, not maps alone.",
            arguments: &[("text", "a text in JSON")],
            example: "parse_json(\"[1, 2.5]\")[1]           // 2.5\nparse_json(`{\"a\": true}`).a         // true",
            register: |engine| {
                engine.register_fn("parse_json", |text: &str| parse_json(text, None));
            },
        },
        Function {
            name: "load_text",
            forms: &["load_text(file) -> text"],
            text: "The text of a file in UTF-8.",
            arguments: &[FILE],
            example: "// for line in load_text(\"poem.txt\").split(\"\\n\") { print(line); }",
            register: |engine| {
                engine.register_fn("load_text", |name: &str| -> Fallible<String> { Ok(read("load_text", name)?.1) });
            },
        },
    ],
};

/// Goes through the rows of a table.
pub struct TableRows {
    table: DataTable,
    next: usize,
}

impl IntoIterator for DataTable {
    type Item = Dynamic;
    type IntoIter = TableRows;
    fn into_iter(self) -> TableRows {
        TableRows { table: self, next: 0 }
    }
}

impl Iterator for TableRows {
    type Item = Dynamic;
    fn next(&mut self) -> Option<Dynamic> {
        let index = self.next;
        self.next += 1;
        (index < self.table.0.rows).then(|| self.table.row(index).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a mistake says, with its place.
    fn complaint(error: ::rhai::EvalAltResult) -> String {
        let ::rhai::EvalAltResult::ErrorRuntime(payload, _) = error else { return error.to_string() };
        format!("{:?}", payload.cast::<crate::script::errors::Complaint>())
    }

    #[test]
    fn json_of_any_kind_is_read() {
        assert!(parse_json("3", None).unwrap().is_int());
        assert!(parse_json("[]", None).unwrap().is_array());
        assert!(parse_json("{\"a\": [null]}", None).unwrap().is_map());
        let wrong = complaint(*parse_json("{\n  \"a\": ,\n}", Some("a.json".into())).unwrap_err());
        assert!(wrong.contains("line: 2") && wrong.contains("no JSON"), "{wrong}");
    }
}
