//! The picture formats that frames are written in: one table, one entry for each format.
//!
//! A new format is a file or folder beside `png/` and `exr/` that declares a [`Format`], and its name in [`FORMATS`]. Everything
//! else (names of files, `-o`, what a finished frame says of itself, copies of it, `diff`, `info`) goes by this table.

use std::path::Path;

use super::format::Format;
use super::metadata::{PIXELS, text_under};
use super::{exr, png};
use crate::base::diagnostics::{Cause, Diagnostic};
use crate::components::{Aov, Render};

/// All formats, the usual one first.
pub const FORMATS: [&Format; 2] = [&png::PNG, &exr::EXR];

impl Format {
    /// The format that a file's name asks for.
    pub fn of_path(path: &Path) -> Option<&'static Format> {
        // Not `Path::extension`: a pattern may begin with its number, so that `.png` is all that is known of the name.
        let name = path.to_string_lossy().to_lowercase();
        let ends = |extension: &str| name.strip_suffix(extension).is_some_and(|rest| rest.ends_with('.'));
        FORMATS.into_iter().find(|format| format.extensions.iter().any(|extension| ends(extension)))
    }

    /// The format that a file's first bytes say that it has.
    pub fn of_bytes(bytes: &[u8]) -> Option<&'static Format> {
        FORMATS.into_iter().find(|format| bytes.starts_with(format.signature))
    }

    /// All endings of file names, as a message lists them.
    pub fn known_extensions() -> String {
        let all: Vec<String> = FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}")).collect();
        all.join(" or ")
    }

    /// Whether files of this format can hold what the settings ask for; `file` is the one that is to be written.
    ///
    /// # Errors
    /// What they cannot hold, and what to do about it.
    pub fn check_settings(&self, render: &Render, file: &Path) -> Result<(), Diagnostic> {
        let wrong = |what: String, help: String| Err(Diagnostic::error(what).help(help).because(Cause::Usage));
        let instead = |suits: &dyn Fn(&Format) -> bool| {
            let other = FORMATS.into_iter().find(|format| suits(format));
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            other.map(|other| {
                let ending = other.extensions[0];
                format!("write an {} file, as in -o {stem}.{ending} or -o 'folder/f.####.{ending}'", other.name)
            })
        };
        let lost: Vec<Aov> = render.aovs.iter().copied().filter(|aov| !(self.holds)(*aov)).collect();
        if !lost.is_empty() {
            let list: Vec<&str> = lost.iter().map(|aov| aov.name()).collect();
            let what = format!("a {} file cannot hold the layers of `aovs`: {}", self.name, list.join(", "));
            let other = instead(&|format| render.aovs.iter().all(|aov| (format.holds)(*aov)));
            let help = other.map_or_else(String::new, |other| other + ", or ");
            return wrong(what, help + "leave them out with --aovs none");
        }
        let holds_depth = |format: &Format| format.bit_depths.iter().any(|(bits, _)| *bits == render.bit_depth);
        if !holds_depth(self) {
            let known: Vec<String> = self.bit_depths.iter().map(|(bits, _)| bits.to_string()).collect();
            let (name, bits) = (self.name, render.bit_depth);
            let what = format!("a {name} file has {} bits per channel, not {bits}", known.join(" or "));
            let help = instead(&holds_depth).unwrap_or_else(|| format!("take --depth {}", known[0]));
            return wrong(what, help);
        }
        Ok(())
    }
}

/// What a file says of its pixels, without a look at them.
pub(super) fn pixels_note(bytes: &[u8]) -> Option<String> {
    let header = (Format::of_bytes(bytes)?.read_header)(bytes).ok()?;
    text_under(&header.metadata, PIXELS).map(str::to_string)
}

#[cfg(test)]
mod tests {
    use super::super::metadata::Metadata;
    use super::*;
    use crate::film::Film;

    #[test]
    fn every_format_is_known_by_its_names_and_by_its_bytes() {
        let film = Film { pixels: vec![[0.0, 0.5, 1.0]; 6], ..Film::new(3, 2) };
        let metadata: Metadata = vec![("Frame".into(), "7".into())];
        for format in FORMATS {
            let render = Render { bit_depth: format.bit_depths[0].0, ..Render::default() };
            let bytes = (format.encode)(&film, &render, &metadata).unwrap();
            assert_eq!(Format::of_bytes(&bytes), Some(format));
            assert_eq!((format.decode)(&bytes).unwrap().size, [3, 2]);
            let header = (format.read_header)(&bytes).unwrap();
            assert_eq!((header.size, &header.metadata), ([3, 2], &metadata));
            assert_eq!((format.checked_metadata)(&bytes).as_ref(), Some(&metadata));
            let changed: Metadata = vec![("Frame".into(), "8".into())];
            let expected = (format.encode)(&film, &render, &changed).unwrap();
            assert!((format.relabel)(&bytes, &metadata, &changed) == Some(expected), "{format:?}");
            for extension in format.extensions {
                for name in [format!("a/b.{extension}"), format!("a.b.{}", extension.to_uppercase())] {
                    assert_eq!(Format::of_path(Path::new(&name)), Some(format));
                }
            }
            for broken in [&b""[..], b"not a picture", &bytes[..bytes.len() / 2]] {
                assert!((format.decode)(broken).is_err() && (format.checked_metadata)(broken).is_none());
                assert_eq!((format.relabel)(broken, &metadata, &changed), None);
            }
        }
        assert_eq!(Format::of_path(Path::new("a.jpg")), None);
        assert_eq!(Format::of_bytes(b""), None);
    }

    #[test]
    fn settings_that_a_format_cannot_hold_are_answered_with_one_that_can() {
        let said = |render: &Render| png::PNG.check_settings(render, Path::new("x/a.png")).unwrap_err().to_string();
        let layers = said(&Render { aovs: vec![Aov::Depth, Aov::Normal], ..Render::default() });
        assert!(layers.contains("a PNG file cannot hold the layers of `aovs`: Depth, Normal"), "{layers}");
        assert!(layers.contains("write an EXR file, as in -o a.exr"), "{layers}");
        let floats = said(&Render { bit_depth: 32, ..Render::default() });
        assert!(floats.contains("8 or 16 bits per channel, not 32") && floats.contains("EXR"), "{floats}");
        let all = Render { bit_depth: 32, aovs: vec![Aov::Depth], ..Render::default() };
        assert!(exr::EXR.check_settings(&all, Path::new("a.exr")).is_ok());
        // Halves hold what eight bits do: nobody has to change the setting for another file.
        assert!(exr::EXR.check_settings(&Render::default(), Path::new("a.exr")).is_ok());
    }
}
