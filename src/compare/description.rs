//! What a frame is made from, as facts that people can read; and how two such lists differ.
//!
//! A golden picture carries the description of the frame that it was, so that a test that fails can say why. There are
//! three grades of it: every value; a digest for each entity; digests of the parts of the frame alone. A picture carries
//! the best that fits.

use rustc_hash::FxHashMap;

use super::report::SceneChange;
use crate::base::digest::{Digest, Hasher};

/// How much a description says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Digests of the parts of the frame.
    Parts,
    /// A digest for each entity and material; values of camera and settings.
    Digests,
    /// Every value that is not at its default.
    Values,
}

impl Detail {
    /// From the best to the shortest.
    pub const ALL: [Detail; 3] = [Detail::Values, Detail::Digests, Detail::Parts];

    fn word(self) -> &'static str {
        match self {
            Detail::Values => "values",
            Detail::Digests => "digests",
            Detail::Parts => "parts",
        }
    }
}

/// What a fact is about; each kind is told apart in a description of less detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    /// The program and its numbers; digests of the parts of the frame.
    Frame,
    /// Camera and settings.
    Scene,
    /// A material of the scene.
    Material,
    /// An entity of the scene.
    Entity,
}

impl Topic {
    fn letter(self) -> char {
        match self {
            Topic::Frame => 'f',
            Topic::Scene => 's',
            Topic::Material => 'm',
            Topic::Entity => 'e',
        }
    }

    fn parse(letter: &str) -> Option<Topic> {
        [Topic::Frame, Topic::Scene, Topic::Material, Topic::Entity]
            .into_iter()
            .find(|t| letter.chars().eq([t.letter()]))
    }
}

/// One thing that is so in a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// What kind of thing it is about.
    pub topic: Topic,
    /// Whose it is: "camera", "entity `key`".
    pub subject: String,
    /// Which of its values; empty for the digest of all of them.
    pub field: String,
    /// The value as text; a digest where it would be long.
    pub value: String,
}

/// A frame as facts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameDescription {
    /// How much is said.
    pub detail: Detail,
    /// In the order in which the frame's parts stand in the scene.
    pub facts: Vec<Fact>,
}

/// The first line of a description as text.
const HEADER: &str = "anim frame 1 ";

impl FrameDescription {
    /// The same frame in less detail, or as it is.
    pub fn reduced(&self, detail: Detail) -> FrameDescription {
        if detail >= self.detail {
            return self.clone();
        }
        let mut facts: Vec<Fact> = Vec::new();
        let mut digests: Vec<(Topic, String, Hasher)> = Vec::new();
        for fact in &self.facts {
            let is_kept = fact.topic == Topic::Frame || (fact.topic == Topic::Scene && detail == Detail::Digests);
            if is_kept {
                facts.push(fact.clone());
                continue;
            }
            if detail == Detail::Parts {
                continue;
            }
            // The facts of a subject follow each other.
            if digests.last().is_none_or(|(topic, subject, _)| *topic != fact.topic || *subject != fact.subject) {
                digests.push((fact.topic, fact.subject.clone(), Hasher::default()));
            }
            if let Some((.., hasher)) = digests.last_mut() {
                hasher.text(&fact.field);
                hasher.text(&fact.value);
            }
        }
        let digest = |(topic, subject, hasher): (Topic, String, Hasher)| {
            // Short: there may be a thousand, and each only has to differ from what it was.
            let value = format!("{:06x}", hasher.finish().0 as u32 >> 8);
            Fact { topic, subject, field: String::new(), value }
        };
        facts.extend(digests.into_iter().map(digest));
        FrameDescription { detail, facts }
    }

    /// The best grade of this description whose text is small enough.
    pub fn fitting(&self, is_small: impl Fn(&str) -> bool) -> FrameDescription {
        let grades = Detail::ALL.into_iter().map(|detail| self.reduced(detail));
        let mut last = None;
        for grade in grades {
            if is_small(&grade.to_text()) {
                return grade;
            }
            last = Some(grade);
        }
        last.unwrap_or_else(|| self.clone())
    }

    /// As text: a line for each fact, its subject only where it is another than in the line before.
    pub fn to_text(&self) -> String {
        let mut text = format!("{HEADER}{}\n", self.detail.word());
        let mut before: Option<&Fact> = None;
        for fact in &self.facts {
            let is_same = before.is_some_and(|b| b.topic == fact.topic && b.subject == fact.subject);
            if !is_same {
                text.push(fact.topic.letter());
                let is_next = before.is_some_and(|b| next_of(&b.subject).is_some_and(|next| next == fact.subject));
                text.push_str(&if is_next { NEXT.to_string() } else { kept(&fact.subject) });
            }
            text.push('\t');
            text.push_str(&kept(&fact.field));
            text.push('\t');
            text.push_str(&kept(&fact.value));
            text.push('\n');
            before = Some(fact);
        }
        text
    }

    /// Reads what [`Self::to_text`] wrote; `None` if it is something else.
    pub fn parse(text: &str) -> Option<FrameDescription> {
        let mut lines = text.lines();
        let word = lines.next()?.strip_prefix(HEADER)?;
        let detail = Detail::ALL.into_iter().find(|detail| detail.word() == word)?;
        let mut facts: Vec<Fact> = Vec::new();
        for line in lines {
            let mut columns = line.split('\t');
            let (owner, field, value) = (columns.next()?, columns.next()?, columns.next()?);
            let (topic, subject) = match owner.char_indices().nth(1).map_or(owner.len(), |(at, _)| at) {
                0 => facts.last().map(|fact| (fact.topic, fact.subject.clone()))?,
                at if &owner[at..] == NEXT => (Topic::parse(&owner[..at])?, next_of(&facts.last()?.subject)?),
                at => (Topic::parse(&owner[..at])?, owner[at..].to_string()),
            };
            facts.push(Fact { topic, subject, field: field.to_string(), value: value.to_string() });
        }
        Some(FrameDescription { detail, facts })
    }

    /// What is another in `now` than in this one, in the order of the facts; digests of parts only where nothing else is.
    pub fn changes(&self, now: &FrameDescription) -> Vec<SceneChange> {
        let detail = self.detail.min(now.detail);
        let (before, now) = (self.reduced(detail), now.reduced(detail));
        let (known, there) = (before.subjects(), now.subjects());
        let mut changes = Vec::new();
        let mut parts = Vec::new();
        for (key, facts) in ordered(&before, &now, &known, &there) {
            let (old, new) = (known.get(&key), there.get(&key));
            match (old, new) {
                (Some(_), None) if key.0 == Topic::Entity || key.0 == Topic::Material => {
                    changes.push(SceneChange { what: key.1.clone(), before: Some("there".into()), after: None });
                }
                (None, Some(_)) if key.0 == Topic::Entity || key.0 == Topic::Material => {
                    changes.push(SceneChange { what: key.1.clone(), before: None, after: Some("there".into()) });
                }
                _ => {
                    let list = if key.0 == Topic::Frame && key.1 == PARTS { &mut parts } else { &mut changes };
                    list.extend(facts);
                }
            }
        }
        if changes.is_empty() { parts } else { grouped(changes) }
    }

    fn subjects(&self) -> FxHashMap<(Topic, String), Vec<&Fact>> {
        let mut subjects: FxHashMap<(Topic, String), Vec<&Fact>> = FxHashMap::default();
        for fact in &self.facts {
            subjects.entry((fact.topic, fact.subject.clone())).or_default().push(fact);
        }
        subjects
    }
}

/// Stands for the entity behind the one of the line before: crowds have no names.
const NEXT: &str = "+";

/// "entity 8" behind "entity 7".
fn next_of(subject: &str) -> Option<String> {
    let number: u64 = subject.strip_prefix("entity ")?.parse().ok()?;
    Some(format!("entity {}", number.checked_add(1)?))
}

/// The subject of the digests of a frame's parts.
pub const PARTS: &str = "parts";

type FactsBySubject<'a> = FxHashMap<(Topic, String), Vec<&'a Fact>>;

/// Every subject of either description in order, with the changes of its facts.
fn ordered(
    before: &FrameDescription,
    now: &FrameDescription,
    known: &FactsBySubject,
    there: &FactsBySubject,
) -> Vec<((Topic, String), Vec<SceneChange>)> {
    let mut keys: Vec<(Topic, String)> = Vec::new();
    let mut seen = rustc_hash::FxHashSet::default();
    for fact in before.facts.iter().chain(&now.facts) {
        let key = (fact.topic, fact.subject.clone());
        if seen.insert(key.clone()) {
            keys.push(key);
        }
    }
    let none = Vec::new();
    let with_changes = |key: (Topic, String)| {
        let (old, new) = (known.get(&key).unwrap_or(&none), there.get(&key).unwrap_or(&none));
        let changes = changes_of(&key.1, old, new);
        (key, changes)
    };
    keys.into_iter().map(with_changes).collect()
}

fn changes_of(subject: &str, old: &[&Fact], new: &[&Fact]) -> Vec<SceneChange> {
    let find =
        |facts: &[&Fact], field: &str| facts.iter().find(|fact| fact.field == field).map(|fact| fact.value.clone());
    let mut fields: Vec<&str> = old.iter().chain(new).map(|fact| fact.field.as_str()).collect();
    let mut seen = rustc_hash::FxHashSet::default();
    fields.retain(|field| seen.insert(*field));
    let change = |field: &str| {
        let (before, after) = (find(old, field), find(new, field));
        if before == after {
            return None;
        }
        if field.is_empty() {
            // Two digests tell nothing but that they differ.
            return Some(SceneChange { what: format!("{subject}: something of it"), before: None, after: None });
        }
        Some(SceneChange { what: format!("{subject}: {field}"), before: before.or(usual()), after: after.or(usual()) })
    };
    fields.into_iter().filter_map(change).collect()
}

/// The value of a fact that is not there: only what is not at its default is a fact.
fn usual() -> Option<String> {
    Some("(default)".into())
}

/// So many changes of one kind are listed one by one.
const LISTED: usize = 8;

/// Many changes of one field are told as one.
fn grouped(changes: Vec<SceneChange>) -> Vec<SceneChange> {
    let kind = |change: &SceneChange| match change.what.split_once(": ") {
        Some((subject, field)) if subject.starts_with("entity") => format!("entities: {field}"),
        None if change.what.starts_with("entity") && change.before.is_none() => "new entities".to_string(),
        None if change.what.starts_with("entity") => "entities that are gone".to_string(),
        _ => change.what.clone(),
    };
    let mut counts: FxHashMap<String, usize> = FxHashMap::default();
    changes.iter().for_each(|change| *counts.entry(kind(change)).or_default() += 1);
    let mut told: FxHashMap<String, usize> = FxHashMap::default();
    let mut out = Vec::new();
    for change in changes {
        let kind = kind(&change);
        let count = counts[&kind];
        let so_far = told.entry(kind.clone()).or_default();
        *so_far += 1;
        if count <= LISTED || *so_far < LISTED {
            out.push(change);
        } else if *so_far == LISTED {
            let what = format!("{kind}, and {} more of the kind", count - (LISTED - 1));
            out.push(SceneChange { what, before: None, after: None });
        }
    }
    out
}

/// A text without the signs that part lines and columns.
fn kept(text: &str) -> String {
    text.replace(['\t', '\n', '\r'], " ")
}

/// A digest as it stands in a description.
pub fn short(digest: Digest) -> String {
    format!("{:016x}", digest.0 as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fact(topic: Topic, subject: &str, field: &str, value: &str) -> Fact {
        Fact { topic, subject: subject.into(), field: field.into(), value: value.into() }
    }

    fn frame(fov: &str, key: &str) -> FrameDescription {
        FrameDescription {
            detail: Detail::Values,
            facts: vec![
                fact(Topic::Frame, "program", "version", "0.1.0"),
                fact(Topic::Frame, PARTS, "camera", fov),
                fact(Topic::Frame, PARTS, "lights", key),
                fact(Topic::Scene, "camera", "fov", fov),
                fact(Topic::Entity, "entity `key`", "translation", key),
                fact(Topic::Entity, "entity `key`", "area_light.size", "(1, 1)"),
                fact(Topic::Entity, "entity `floor`", "plane", ""),
            ],
        }
    }

    fn said(a: &FrameDescription, b: &FrameDescription) -> Vec<String> {
        a.changes(b).iter().map(SceneChange::to_string).collect()
    }

    #[test]
    fn a_description_comes_back_from_its_text() {
        for detail in Detail::ALL {
            let one = frame("40", "(3, 4, 2)").reduced(detail);
            assert_eq!(one.detail, detail);
            assert_eq!(FrameDescription::parse(&one.to_text()), Some(one));
        }
        for text in ["", "anim frame 1 x\n", "anim frame 1 values\nsomething", "anim frame 1 values\n\ta\tb\n"] {
            assert_eq!(FrameDescription::parse(text), None, "{text}");
        }
        let crowd = |n: usize| fact(Topic::Entity, &format!("entity {n}"), "sphere", "there");
        let crowd = FrameDescription { detail: Detail::Values, facts: [1, 2, 3, 9, 10, 10].map(crowd).to_vec() };
        assert_eq!(FrameDescription::parse(&crowd.to_text()), Some(crowd));
        let odd = FrameDescription { detail: Detail::Values, facts: vec![fact(Topic::Entity, "a\tb", "c\n", "")] };
        assert_eq!(FrameDescription::parse(&odd.to_text()).unwrap().facts[0].subject, "a b");
    }

    #[test]
    fn changes_are_told_with_their_values() {
        let (a, b) = (frame("40", "(3, 4, 2)"), frame("40", "(3, 4, 2.5)"));
        assert_eq!(said(&a, &b), ["entity `key`: translation (3, 4, 2) -> (3, 4, 2.5)"]);
        assert_eq!(said(&a, &frame("50", "(3, 4, 2)")), ["camera: fov 40 -> 50"]);
        assert!(said(&a, &a).is_empty());
        let mut c = a.clone();
        c.facts.remove(3);
        c.facts.pop();
        assert_eq!(said(&a, &c), ["camera: fov 40 -> (default)", "entity `floor` there (gone)"]);
        assert_eq!(said(&c, &a)[1], "entity `floor` there (new)");
    }

    #[test]
    fn less_detail_tells_less_and_never_nothing() {
        let (a, b) = (frame("40", "(3, 4, 2)"), frame("40", "(3, 4, 2.5)"));
        assert_eq!(said(&a.reduced(Detail::Digests), &b), ["entity `key`: something of it"]);
        assert_eq!(said(&a, &b.reduced(Detail::Parts)), ["parts: lights (3, 4, 2) -> (3, 4, 2.5)"]);
        let fits = |most: usize| a.fitting(|text| text.len() <= most).detail;
        assert_eq!((fits(10_000), fits(150), fits(1)), (Detail::Values, Detail::Digests, Detail::Parts));
    }

    #[test]
    fn many_changes_of_a_kind_are_told_as_one() {
        let crowd = |x: &str| {
            let one = |i: usize| fact(Topic::Entity, &format!("entity {i}"), "translation", x);
            FrameDescription { detail: Detail::Values, facts: (1..=100).map(one).collect() }
        };
        let said = said(&crowd("1"), &crowd("2"));
        assert_eq!(said.len(), LISTED);
        assert_eq!(said[0], "entity 1: translation 1 -> 2");
        assert_eq!(said[LISTED - 1], "entities: translation, and 93 more of the kind");
    }
}
