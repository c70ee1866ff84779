//! CSV as typed columns, with every mistake at its place in the file.

use std::sync::Arc;

use ::rhai::{Dynamic, ImmutableString, Map};

use super::errors::{Fallible, complain, complain_at};
use crate::base::diagnostics::{Place, suggestion};

/// What stands in a file for a value that is missing.
const MISSING: [&str; 7] = ["", "NA", "N/A", "NaN", "nan", "null", "NULL"];

/// A table by its columns.
pub struct CsvColumns {
    pub file: Arc<str>,
    pub names: Vec<String>,
    /// Column by column; `()` where a value is missing.
    pub values: Vec<Vec<Dynamic>>,
    pub rows: usize,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ColumnType {
    Whole,
    Number,
    Bool,
    Text,
}

impl ColumnType {
    const WORDS: [&str; 4] = ["whole", "number", "bool", "text"];

    /// The type of a text that is not missing.
    fn of(text: &str) -> ColumnType {
        if text.parse::<i64>().is_ok() {
            ColumnType::Whole
        } else if text.parse::<f64>().is_ok_and(f64::is_finite) {
            ColumnType::Number
        } else if text.parse::<bool>().is_ok() {
            ColumnType::Bool
        } else {
            ColumnType::Text
        }
    }

    /// A value of this type.
    fn read(self, text: &str) -> Option<Dynamic> {
        match self {
            ColumnType::Whole => text.parse::<i64>().ok().map(Dynamic::from),
            ColumnType::Number => text.parse::<f64>().ok().filter(|x| x.is_finite()).map(Dynamic::from),
            ColumnType::Bool => text.parse::<bool>().ok().map(Dynamic::from),
            ColumnType::Text => Some(ImmutableString::from(text).into()),
        }
    }

    fn expected(self) -> &'static str {
        match self {
            ColumnType::Whole => "a whole number",
            ColumnType::Number => "a number",
            ColumnType::Bool => "true or false",
            ColumnType::Text => "a text",
        }
    }
}

/// The text of a CSV file.
pub struct CsvText<'a> {
    pub file: &'a Arc<str>,
    pub text: &'a str,
    pub separator: u8,
}

/// A field with where it begins in the text.
type CsvField = (String, usize);

impl CsvText<'_> {
    fn place(&self, start: usize, length: usize) -> Place {
        Place::of_span(self.file.clone(), self.text, start, start + length.max(1))
    }

    /// All records, each of its fields with its place.
    fn records(&self) -> Fallible<Vec<Vec<CsvField>>> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(self.separator)
            .trim(csv::Trim::All)
            .from_reader(self.text.as_bytes());
        let mut records = Vec::new();
        for record in reader.records() {
            let record = match record {
                Ok(record) => record,
                Err(error) => {
                    let at = error.position().map_or(0, |at| at.byte() as usize);
                    return complain_at(self.place(at, 1), "this is no CSV".to_string(), None);
                }
            };
            let mut at = record.position().map_or(0, |at| at.byte() as usize);
            let fields = record.iter().map(|field| {
                // Fields are found again in the text, from the end of the one before.
                let start = self.text[at..].find(field).map_or(at, |found| at + found);
                at = start + field.len();
                (field.to_string(), start)
            });
            records.push(fields.collect());
        }
        Ok(records)
    }

    /// The columns of the text.
    ///
    /// # Errors
    /// Rows of another length, columns of one name, values of another type than their column has.
    pub fn read(&self, has_header: bool, types: &Map) -> Fallible<CsvColumns> {
        let mut records = self.records()?.into_iter();
        let names: Vec<CsvField> = match has_header {
            true => records.next().unwrap_or_default(),
            false => Vec::new(),
        };
        let records: Vec<Vec<CsvField>> =
            records.filter(|record| record.len() > 1 || !record[0].0.is_empty()).collect();
        let width = if has_header { names.len() } else { records.first().map_or(0, Vec::len) };
        for (i, (name, at)) in names.iter().enumerate() {
            if names[..i].iter().any(|(other, _)| other == name) {
                return complain_at(self.place(*at, name.len()), format!("two columns are called `{name}`"), None);
            }
        }
        if let Some(record) = records.iter().find(|record| record.len() != width) {
            let message = format!("expected {width} values in this row, found {}", record.len());
            let help = (width == 1 && record.len() == 1).then(|| "is the separator another one?".to_string());
            return complain_at(self.place(record[0].1, record[0].0.len()), message, help);
        }
        let names: Vec<String> = match has_header {
            true => names.into_iter().map(|(name, _)| name).collect(),
            false => (1..=width).map(|i| format!("c{i}")).collect(),
        };
        if let Some(unknown) = types.keys().find(|name| !names.iter().any(|known| known == name.as_str())) {
            let help = suggestion(unknown, names.iter().map(String::as_str));
            return complain(format!("{} has no column `{unknown}`", self.file), help);
        }
        let rows = records.len();
        let column =
            |i: usize| self.column(&names[i], types.get(names[i].as_str()), records.iter().map(move |r| &r[i]));
        let values = (0..width).map(column).collect::<Fallible<_>>()?;
        Ok(CsvColumns { file: self.file.clone(), names, values, rows })
    }

    /// The values of a column; what most of them are, all of them must be.
    fn column<'f>(
        &self,
        name: &str,
        wanted: Option<&Dynamic>,
        fields: impl Iterator<Item = &'f CsvField> + Clone,
    ) -> Fallible<Vec<Dynamic>> {
        let is_missing = |text: &str| MISSING.contains(&text);
        let types = fields.clone().filter(|field| !is_missing(&field.0)).map(|field| ColumnType::of(&field.0));
        let mut counts = [0usize; 4];
        types.for_each(|found| counts[found as usize] += 1);
        let [whole, number, bool, text] = counts;
        let all = whole + number + bool + text;
        let kind = match wanted.map(|wanted| wanted.to_string()) {
            Some(word) => match ColumnType::WORDS.iter().position(|known| **known == word) {
                Some(i) => [ColumnType::Whole, ColumnType::Number, ColumnType::Bool, ColumnType::Text][i],
                None => return complain(format!("a column cannot be `{word}`"), suggestion(&word, ColumnType::WORDS)),
            },
            None if 2 * (whole + number) > all && number > 0 => ColumnType::Number,
            None if 2 * whole > all => ColumnType::Whole,
            None if 2 * bool > all => ColumnType::Bool,
            None => ColumnType::Text,
        };
        let value = |(text, at): &CsvField| match is_missing(text) {
            true => Ok(Dynamic::UNIT),
            false => match kind.read(text) {
                Some(value) => Ok(value),
                None => complain_at(
                    self.place(*at, text.len()),
                    format!("expected {} in the column `{name}`, found `{text}`", kind.expected()),
                    Some(format!(
                        "load_csv(file, #{{ types: #{{ {name}: \"text\" }} }}) reads the column as it is written"
                    )),
                ),
            },
        };
        fields.map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Fallible<CsvColumns> {
        CsvText { file: &"a.csv".into(), text, separator: b',' }.read(true, &Map::new())
    }

    /// What a mistake says, with its place.
    fn complaint(error: ::rhai::EvalAltResult) -> String {
        let ::rhai::EvalAltResult::ErrorRuntime(payload, _) = error else { return error.to_string() };
        format!("{:?}", payload.cast::<crate::script::errors::Complaint>())
    }

    #[test]
    fn columns_have_the_type_of_most_of_their_values() {
        let columns = table("n,x,b,t\n1,2.5,true,a\n2,,false,1\n3,4,true,NA\n").ok().unwrap();
        assert_eq!(columns.rows, 3);
        assert!(columns.values[0].iter().all(|v| v.is_int()));
        assert!(columns.values[1][0].is_float() && columns.values[1][1].is_unit() && columns.values[1][2].is_float());
        assert!(columns.values[2].iter().all(|v| v.is_bool()));
        assert!(columns.values[3][0].is_string() && columns.values[3][2].is_unit());
    }

    #[test]
    fn mistakes_have_their_place_in_the_file() {
        let said = |text: &str| match table(text) {
            Ok(_) => String::new(),
            Err(error) => complaint(*error),
        };
        let wrong = said("t,level\n1,2.5\n2,\"x, y\"\n3,1\n4,1\n");
        assert!(wrong.contains("line: 3") && wrong.contains("column: 4") && wrong.contains("`level`"), "{wrong}");
        assert!(said("a,b\n1\n").contains("expected 2 values in this row, found 1"));
        assert!(said("a,a\n1,2\n").contains("two columns are called `a`"));
    }
}
