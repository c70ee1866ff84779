//! Which rays meet a body or a light, what a light lights, and what throws shadows in it.

use super::Text;
use super::record::{Check, Invalid, record};

record! {
    /// Which rays meet what the entity carries: its bodies, and its area light if it has one.
    pub struct Visible {
        /// Whether the camera sees it. Where this is not given, bodies are seen, and area lights as their own `visible`
        /// says. What is seen in mirrors and through glass is told by `reflection`.
        pub camera: Option<bool> = None,
        /// Whether its bodies throw shadows. Of a light without a body: whether anything throws a shadow in its light.
        pub shadow: bool = true,
        /// Whether rays meet it that left a surface: in mirrors, through glass, and as light that surfaces hand on.
        pub reflection: bool = true,
    }
}

impl Check for Visible {
    fn check(&self) -> Result<(), Invalid> {
        Ok(())
    }
}

impl Visible {
    /// The same answer for all rays.
    pub fn all(shown: bool) -> Visible {
        Visible { camera: Some(shown), shadow: shown, reflection: shown }
    }
}

record! {
    /// Which bodies the lights of the entity light, by tags; what of the entity emits light counts as one.
    pub struct LightLink {
        /// Tags: only bodies that have one of them are lit. Empty: all bodies are.
        pub includes: Vec<Text> = Vec::new(),
        /// Tags: bodies that have one of them are not lit.
        pub excludes: Vec<Text> = Vec::new(),
    }
}

record! {
    /// Which bodies throw shadows in the light of the entity, by tags.
    pub struct ShadowLink {
        /// Tags: only bodies that have one of them throw shadows. Empty: all bodies do.
        pub includes: Vec<Text> = Vec::new(),
        /// Tags: bodies that have one of them throw none.
        pub excludes: Vec<Text> = Vec::new(),
    }
}

/// Whether tags belong to what these lists choose.
fn chooses(includes: &[Text], excludes: &[Text], tags: &[Text]) -> bool {
    let has_one = |list: &[Text]| tags.iter().any(|tag| list.contains(tag));
    (includes.is_empty() || has_one(includes)) && !has_one(excludes)
}

/// A tag that is no word chooses nothing.
fn words(field: &'static str, tags: &[Text]) -> Result<(), Invalid> {
    let message = || format!("`{field}` must name tags, not an empty text");
    tags.iter().try_for_each(|tag| if tag.is_empty() { Err(Invalid { field, message: message() }) } else { Ok(()) })
}

/// What both links do.
macro_rules! links {
    ($($link:ident),*) => {
        $(
            impl Check for $link {
                fn check(&self) -> Result<(), Invalid> {
                    words("includes", &self.includes)?;
                    words("excludes", &self.excludes)
                }
            }

            impl $link {
                /// Whether bodies with these tags are among those that it chooses.
                pub fn chooses(&self, tags: &[Text]) -> bool {
                    chooses(&self.includes, &self.excludes, tags)
                }

                /// Every tag that it names.
                pub fn tags(&self) -> impl Iterator<Item = &Text> {
                    self.includes.iter().chain(&self.excludes)
                }
            }
        )*
    };
}
links!(LightLink, ShadowLink);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_choose_by_any_tag_and_exclude_last() {
        let texts = |words: &[&str]| words.iter().map(|word| Text::from(*word)).collect::<Vec<Text>>();
        let link =
            |includes: &[&str], excludes: &[&str]| LightLink { includes: texts(includes), excludes: texts(excludes) };
        let chosen = |link: LightLink, tags: &[&str]| link.chooses(&texts(tags));
        assert!(chosen(link(&[], &[]), &[]));
        assert!(chosen(link(&["a", "b"], &[]), &["x", "b"]) && !chosen(link(&["a"], &[]), &["x"]));
        assert!(!chosen(link(&["a"], &[]), &[]) && chosen(link(&[], &["a"]), &["x"]));
        assert!(!chosen(link(&["a"], &["b"]), &["a", "b"]));
        assert_eq!(link(&[""], &[]).check().unwrap_err().field, "includes");
    }
}
