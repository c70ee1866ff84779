//! Everything that a shot needs, in one archive: `show.anim.zip`, or a folder of the same layout.
//!
//! ```text
//! manifest.json          which files there are, what they hold, and what made the archive
//! contents/HASH          the bytes of files, each once, named by their digest
//! ```
//!
//! Contents are named by digest, so that whoever copies the folder form a second time sends only what is new. Names, order
//! and times are fixed: equal input gives equal bytes. Nothing in an archive is believed: paths lead down from the folder
//! that it is unpacked into, contents are those of their digests, and sizes have limits. The digest finds damage and
//! mix-ups; it is no signature.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use rawzip::{
    CompressionMethod, FileReader, RECOMMENDED_BUFFER_SIZE, ZipArchive, ZipArchiveEntryWayfinder, ZipArchiveWriter,
};
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

use crate::base::diagnostics::{Cause, Diagnostic, nearest};
use crate::base::digest::Digest;
use crate::base::project::{FileRole, tidy};
use crate::base::{files, limits};
use crate::output::{AtomicFile, write_atomic};
use crate::shot::Shot;
use crate::shot::fingerprint::PICTURES;

/// How the file form of an archive is called.
pub const ENDING: &str = ".anim.zip";
/// How the folder form is called.
pub const FOLDER_ENDING: &str = ".anim";
const MANIFEST: &str = "manifest.json";
const CONTENTS: &str = "contents/";
/// The layout; it rises when older programs cannot read what newer ones write.
const LAYOUT: u32 = 1;

/// What an archive says of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackManifest {
    /// Version of this layout.
    pub layout: u32,
    /// Version of the program that packed it.
    pub anim: String,
    /// Its picture version: another one makes other pixels.
    pub pictures: u32,
    /// The script or scene, as a path in the archive.
    pub input: String,
    /// Values of the script's parameters that it was packed with.
    pub parameters: BTreeMap<String, String>,
    /// Every file, in the order of the paths.
    pub files: Vec<PackedFile>,
}

/// One file of an archive.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackedFile {
    /// From the project's root down, with `/` between its parts.
    pub path: String,
    /// What it is read as: script, module, scene, mesh, image or data.
    pub role: String,
    /// Its length.
    pub bytes: u64,
    /// Digest of its content.
    pub hash: String,
}

/// What packing came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackSummary {
    /// Files of the shot.
    pub files: usize,
    /// Their bytes together.
    pub bytes: u64,
    /// Contents that were written; the others were there already.
    pub written: usize,
}

/// An archive that was unpacked into a folder of its own, which goes when this is dropped.
#[derive(Clone, Debug)]
pub struct UnpackedArchive {
    /// What it says of its contents.
    pub manifest: PackManifest,
    folder: Arc<TempDir>,
}

impl UnpackedArchive {
    /// The project root.
    pub fn root(&self) -> &Path {
        self.folder.path()
    }

    /// The script or scene.
    pub fn input(&self) -> PathBuf {
        self.root().join(&self.manifest.input)
    }

    /// The folder, for whoever needs it for longer.
    pub fn folder(&self) -> Arc<TempDir> {
        self.folder.clone()
    }

    /// What to say if another version of the program packed it, whose pictures may be others.
    pub fn version_warning(&self, archive: &Path) -> Option<Diagnostic> {
        let PackManifest { anim, pictures, .. } = &self.manifest;
        let message = format!(
            "{} was packed by anim {anim} (picture version {pictures}), and this is anim {} (picture version {PICTURES}): \
             its pictures may differ",
            archive.display(),
            env!("CARGO_PKG_VERSION"),
        );
        (*pictures != PICTURES).then(|| Diagnostic::warning(message))
    }
}

/// Whether a path is one of an archive, going by its name; folders must hold a manifest.
pub fn is_archive(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if path.is_dir() {
        return name.ends_with(FOLDER_ENDING) && path.join(MANIFEST).is_file();
    }
    name.ends_with(".zip")
}

/// The files of a shot as they lie in its project, as far as they are there.
///
/// # Errors
/// A file that lies outside of the project, or whose link leads out of it.
fn files_of(shot: &Shot) -> Result<BTreeMap<String, (PathBuf, FileRole)>, Diagnostic> {
    let root = shot.project().root();
    let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
    let full_root = root.canonicalize().map_err(|e| Diagnostic::io(root.display(), "read", &e))?;
    let by_name = std::path::absolute(root).map(|root| tidy(&root)).unwrap_or_else(|_| full_root.clone());
    let mut files = BTreeMap::new();
    for (path, role) in shot.files().into_iter().filter(|(path, _)| path.is_file()) {
        let outside = |why: &str| {
            let help = "an archive holds files of the project only: copy it there, or pack with --root set to a folder that holds all";
            Diagnostic::error(format!("{} {why} {}", path.display(), full_root.display())).help(help)
        };
        let full = path.canonicalize().map_err(|e| Diagnostic::io(path.display(), "read", &e))?;
        if !full.starts_with(&full_root) {
            let is_link = path.is_symlink();
            return Err(outside(if is_link {
                "is a link that leaves the project"
            } else {
                "lies outside of the project"
            }));
        }
        let named = std::path::absolute(&path).map(|path| tidy(&path)).unwrap_or_else(|_| full.clone());
        let below = named.strip_prefix(&by_name).or_else(|_| named.strip_prefix(&full_root));
        let below =
            below.or_else(|_| full.strip_prefix(&full_root)).map_err(|_| outside("lies outside of the project"))?;
        files.insert(portable(below, &path)?, (path, role));
    }
    Ok(files)
}

/// A path of an archive: its parts with `/` between them.
fn portable(below: &Path, path: &Path) -> Result<String, Diagnostic> {
    let part = |part: Component| part.as_os_str().to_str().map(str::to_string);
    let parts: Option<Vec<String>> = below.components().map(part).collect();
    let text = parts.map(|parts| parts.join("/")).filter(|text| is_safe(text));
    text.ok_or_else(|| {
        let message = format!("{} has a name that not every system can hold", path.display());
        Diagnostic::error(message).help("names in an archive are UTF-8, without \\ and :")
    })
}

/// Whether a path of an archive leads down, on any system.
fn is_safe(path: &str) -> bool {
    let is_plain = |part: &str| !part.is_empty() && part != "." && part != "..";
    let is_odd = |c: char| c == '\\' || c == ':' || c.is_control();
    path.len() <= limits::TEXT_BYTES && path.split('/').all(is_plain) && !path.contains(is_odd)
}

/// Where contents are put: a zip file or a folder.
enum Packer {
    Zip(Box<ZipArchiveWriter<File>>, AtomicFile),
    Folder(PathBuf),
}

impl Packer {
    /// Adds content under a name; whether it was new.
    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<bool, Diagnostic> {
        match self {
            Packer::Zip(archive, file) => {
                let written = add_to_zip(archive, name, bytes);
                written.map(|()| true).map_err(|error| file.failed(&std::io::Error::other(error)))
            }
            Packer::Folder(folder) => {
                let path = folder.join(name);
                let is_there = std::fs::metadata(&path).is_ok_and(|known| known.len() == bytes.len() as u64);
                // A content under its own name cannot be another one, but it can be damaged.
                let is_whole =
                    is_there && files::read_bytes(&path, bytes.len() as u64).is_ok_and(|known| known == bytes);
                if !is_whole {
                    write_atomic(&path, bytes)?;
                }
                Ok(!is_whole)
            }
        }
    }

    fn finish(self) -> Result<(), Diagnostic> {
        match self {
            Packer::Zip(archive, file) => {
                let finished = archive.finish().map(drop);
                finished.map_err(|error| file.failed(&std::io::Error::other(error)))?;
                file.commit()
            }
            Packer::Folder(_) => Ok(()),
        }
    }
}

/// What is packed already, as pictures are, is stored as it is.
fn add_to_zip(archive: &mut ZipArchiveWriter<File>, name: &str, bytes: &[u8]) -> Result<(), rawzip::Error> {
    let mut deflated = DeflateEncoder::new(Vec::new(), Compression::default());
    deflated.write_all(bytes)?;
    let deflated = deflated.finish()?;
    let is_smaller = deflated.len() < bytes.len();
    let method = if is_smaller { CompressionMethod::DEFLATE } else { CompressionMethod::STORE };
    let (mut entry, _) = archive.new_file(name).compression_method(method).start()?;
    entry.write_all(if is_smaller { &deflated } else { bytes })?;
    let said = rawzip::DataDescriptorOutput::new(crc32fast::hash(bytes), bytes.len() as u64);
    entry.finish(said)?;
    Ok(())
}

/// Writes a shot whose frames were all evaluated, with the parameters that it was opened with.
///
/// # Errors
/// Files outside of the project; files that changed meanwhile; what cannot be read or written. Nothing half written is
/// left; in a folder, contents may be.
pub fn write(shot: &Shot, parameters: &[(String, String)], out: &Path) -> Result<PackSummary, Diagnostic> {
    let found = files_of(shot)?;
    let mut summary = PackSummary { files: found.len(), ..PackSummary::default() };
    let mut packer = if out.to_string_lossy().to_lowercase().ends_with(".zip") {
        let file = AtomicFile::create(out)?;
        Packer::Zip(Box::new(ZipArchiveWriter::new(file.handle()?)), file)
    } else {
        std::fs::create_dir_all(out).map_err(|e| Diagnostic::io(out.display(), "write", &e))?;
        Packer::Folder(out.to_path_buf())
    };
    let mut packed = Vec::with_capacity(found.len());
    let mut known = BTreeSet::new();
    for (path, (file, role)) in found {
        let bytes = files::read_bytes(&file, limits::MESH_FILE_BYTES)?;
        let hash = Digest::of(&bytes).to_string();
        summary.bytes += bytes.len() as u64;
        if known.insert(hash.clone()) && packer.add(&format!("{CONTENTS}{hash}"), &bytes)? {
            summary.written += 1;
        }
        packed.push(PackedFile { path, role: role.word().into(), bytes: bytes.len() as u64, hash });
    }
    let manifest = PackManifest {
        layout: LAYOUT,
        anim: env!("CARGO_PKG_VERSION").into(),
        pictures: PICTURES,
        input: shot.input_path(),
        parameters: parameters.iter().cloned().collect(),
        files: packed,
    };
    let text = serde_json::to_string_pretty(&manifest).map_err(|e| Diagnostic::bug(e.to_string()))? + "\n";
    packer.add(MANIFEST, text.as_bytes())?;
    packer.finish()?;
    Ok(summary)
}

/// Where contents are read from.
enum PackSource {
    Zip(Box<ZipArchive<FileReader>>, BTreeMap<String, (ZipArchiveEntryWayfinder, CompressionMethod)>),
    Folder(PathBuf),
}

impl PackSource {
    fn open(path: &Path) -> Result<PackSource, Diagnostic> {
        if path.is_dir() {
            return Ok(PackSource::Folder(path.to_path_buf()));
        }
        if !path.is_file() {
            // It says what is missing, and what is no file, as of every other input.
            files::read_bytes(path, 0)?;
        }
        let file = File::open(path).map_err(|e| Diagnostic::io(path.display(), "read", &e))?;
        let broken =
            |error: rawzip::Error| Diagnostic::error(format!("{} is no whole zip archive: {error}", path.display()));
        let mut buffer = vec![0; RECOMMENDED_BUFFER_SIZE];
        let archive = ZipArchive::from_file(file, &mut buffer).map_err(broken)?;
        let mut entries = BTreeMap::new();
        let mut listed = archive.entries(&mut buffer);
        while let Some(entry) = listed.next_entry().map_err(broken)? {
            let name = String::from_utf8_lossy(entry.file_path().as_ref()).into_owned();
            let at = (entry.wayfinder(), entry.compression_method());
            if entries.insert(name.clone(), at).is_some() || entries.len() > limits::ARCHIVE_FILES + 1 {
                let message = format!("{}: `{name}` is in it twice, or too many files are", path.display());
                return Err(Diagnostic::error(message));
            }
        }
        Ok(PackSource::Zip(Box::new(archive), entries))
    }

    /// The bytes under a name, at most so many; one more says that there are more.
    fn read(&self, name: &str, cap: u64) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        match self {
            PackSource::Folder(folder) => {
                let path = folder.join(name);
                if path.is_symlink() {
                    return Err("it is a link".into());
                }
                if std::fs::metadata(&path).is_ok_and(|known| known.len() > cap) {
                    return Err("its content is not the one that was packed".into());
                }
                bytes = files::read_bytes(&path, cap).map_err(|problem| problem.message)?;
            }
            PackSource::Zip(archive, entries) => {
                let (at, method) = entries.get(name).ok_or("it is missing")?;
                let entry = archive.get_entry(*at).map_err(|e| e.to_string())?;
                let taken = match *method {
                    CompressionMethod::STORE => entry.reader().take(cap + 1).read_to_end(&mut bytes),
                    CompressionMethod::DEFLATE => {
                        DeflateDecoder::new(entry.reader()).take(cap + 1).read_to_end(&mut bytes)
                    }
                    _ => return Err("it is packed in a way that anim does not read (store or deflate)".into()),
                };
                taken.map_err(|error| format!("it is damaged: {error}"))?;
            }
        }
        Ok(bytes)
    }
}

/// Unpacks an archive into a temporary folder.
///
/// # Errors
/// What of it is missing, damaged, too large, or leads out of the folder, each by name.
pub fn unpack(path: &Path) -> Result<UnpackedArchive, Diagnostic> {
    let source = PackSource::open(path)?;
    let wrong = |what: String| Diagnostic::error(format!("{}: {what}", path.display()));
    let text = source.read(MANIFEST, limits::ARCHIVE_MANIFEST_BYTES).map_err(|why| {
        let help = "archives of shots are written by `anim pack`";
        wrong(format!("no archive of a shot: {MANIFEST}: {why}")).help(help)
    })?;
    let manifest: PackManifest =
        serde_json::from_slice(&text).map_err(|error| wrong(format!("{MANIFEST} cannot be understood: {error}")))?;
    check(&manifest).map_err(wrong)?;
    let folder = tempfile::Builder::new().prefix("anim-archive-").tempdir();
    let folder = folder.map_err(|e| Diagnostic::io("a temporary folder", "make", &e))?;
    // Without links in its path: what lies below it is then below it by any name.
    for PackedFile { path: name, bytes, hash, .. } in &manifest.files {
        let refuse = |why: String| wrong(format!("`{name}`: {why}"));
        let content = source.read(&format!("{CONTENTS}{hash}"), *bytes).map_err(refuse)?;
        if content.len() as u64 != *bytes || Digest::of(&content).to_string() != *hash {
            let message = "its content is not the one that was packed";
            return Err(refuse(message.into()).help("the archive was damaged or changed: pack it again"));
        }
        let place = folder.path().join(name);
        let parent = place.parent().unwrap_or(folder.path());
        let written = std::fs::create_dir_all(parent).and_then(|()| std::fs::write(&place, &content));
        written
            .map_err(|e| Diagnostic::io(format!("`{name}` of {}", path.display()), "unpack", &e).because(Cause::Io))?;
    }
    Ok(UnpackedArchive { manifest, folder: Arc::new(folder) })
}

/// Sees to it that a manifest can be followed.
fn check(manifest: &PackManifest) -> Result<(), String> {
    if manifest.layout != LAYOUT {
        return Err(format!(
            "its layout is {}, and this program reads {LAYOUT}: it needs anim {}",
            manifest.layout, manifest.anim
        ));
    }
    if manifest.files.len() > limits::ARCHIVE_FILES {
        return Err(format!("it has {} files, and at most {} are read", manifest.files.len(), limits::ARCHIVE_FILES));
    }
    let mut total = 0u64;
    let mut names = BTreeSet::new();
    for PackedFile { path, bytes, hash, .. } in &manifest.files {
        if !is_safe(path) {
            return Err(format!("`{path}` leads out of the archive"));
        }
        if !names.insert(path.as_str()) {
            return Err(format!("`{path}` is in it twice"));
        }
        if hash.parse::<Digest>().is_err() {
            return Err(format!("`{path}` has no digest"));
        }
        total = total.saturating_add(*bytes);
        if *bytes > limits::MESH_FILE_BYTES || total > limits::ARCHIVE_BYTES {
            return Err(format!("`{path}` makes it larger than the limit of {} GiB", limits::ARCHIVE_BYTES >> 30));
        }
    }
    if !names.contains(manifest.input.as_str()) {
        let near = nearest(&manifest.input, names.iter().copied()).map(|near| format!("; there is `{near}`"));
        return Err(format!("its input `{}` is not in it{}", manifest.input, near.unwrap_or_default()));
    }
    Ok(())
}
