//! Files that a scene names in its fields, by their content.

use std::fs::Metadata;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rustc_hash::FxHashMap;

use crate::base::digest::{Digest, Hasher};
use crate::base::project::{self, FileRole, Folder};
use crate::base::{files, limits};
use crate::components::{Text, Value};

/// Any text in a scene that is the path of a file or folder, relative to the scene, stands for what is in there.
///
/// Which fields name files need not be known: a word that happens to be a file's name only makes the digest depend on
/// more than it must. Each file is read once in a run.
pub struct Assets {
    base: Folder,
    known: Mutex<FxHashMap<Text, Option<AssetContent>>>,
}

/// What was read under a name, and what the system said of the file before.
struct AssetContent {
    digest: Digest,
    stamp: Option<Metadata>,
}

impl Assets {
    pub fn new(base: Folder) -> Self {
        Assets { base, known: Mutex::default() }
    }

    /// Feeds the content of every file that the value names.
    pub fn feed(&self, value: &Value, hasher: &mut Hasher) {
        match value {
            Value::Text(text) => {
                if let Some(digest) = self.content(text) {
                    hasher.digest(digest);
                }
            }
            Value::List(items) => items.iter().for_each(|item| self.feed(item, hasher)),
            Value::Map(entries) => entries.iter().for_each(|(_, value)| self.feed(value, hasher)),
            Value::Unit | Value::Bool(_) | Value::Int(_) | Value::Number(_) | Value::Vec3(_) => {}
        }
    }

    /// The digest of the file or folder of that name; `None` if there is none.
    pub fn content(&self, name: &Text) -> Option<Digest> {
        if name.is_empty() {
            return None;
        }
        // The map is whole even if a thread panicked while it held the lock.
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(content) = known.get(name) {
            return content.as_ref().map(|c| c.digest);
        }
        // A name that leads out of the project is refused by whoever reads it.
        let path = self.base.admit(name).ok();
        let stamp = path.as_ref().and_then(|path| std::fs::metadata(path).ok());
        let content = path.as_ref().and_then(|path| read(path)).map(|digest| AssetContent { digest, stamp });
        if let Some(path) = path.filter(|_| content.is_some()) {
            // Whoever reads it says what as, if anybody does; the digest depends on it either way.
            self.base.project().record(&path, FileRole::Data);
        }
        let digest = content.as_ref().map(|c| c.digest);
        known.insert(name.clone(), content);
        digest
    }

    /// A file that is no longer what was read. One that is gone is not: whoever needs it says so.
    pub fn changed(&self) -> Option<String> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let is_changed = |name: &Text, content: &AssetContent| {
            let now = std::fs::metadata(self.base.join(&**name));
            now.is_ok_and(|now| !content.stamp.as_ref().is_some_and(|then| is_same(&now, then)))
        };
        let changed = known.iter().find(|(name, content)| content.as_ref().is_some_and(|c| is_changed(name, c)));
        changed.map(|(name, _)| name.to_string())
    }
}

/// Times are compared and never read.
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    a.len() == b.len() && a.modified().ok() == b.modified().ok()
}

/// What cannot be read counts as not there: the loader says what is wrong with it.
fn read(path: &Path) -> Option<Digest> {
    let kind = std::fs::metadata(path).ok()?;
    if kind.is_file() {
        return files::read_bytes(path, limits::IMAGE_FILE_BYTES).ok().map(|bytes| Digest::of(&bytes));
    }
    if !kind.is_dir() {
        return None;
    }
    let mut hasher = Hasher::default();
    for picture in project::contents(path) {
        hasher.text(&picture.file_name()?.to_string_lossy());
        hasher.digest(files::read_bytes(&picture, limits::IMAGE_FILE_BYTES).map_or(Digest(0), |b| Digest::of(&b)));
    }
    Some(hasher.finish())
}
