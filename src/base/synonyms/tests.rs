use super::*;

#[test]
fn only_what_is_known_is_offered() {
    assert_eq!(by_meaning("Position", &["translation", "scale"]), Some(("translation", "")));
    assert_eq!(by_meaning("position", &["at", "from"]), Some(("from", "")));
    assert_eq!(by_meaning("position", &["scale"]), None);
    assert_eq!(by_meaning("samplesPerPixel", &["samples", "size"]).map(|hit| hit.0), Some("samples"));
    assert_eq!(by_meaning("Kd", &["color", "diffuse"]).map(|hit| hit.0), Some("diffuse"));
    assert_eq!(by_meaning("wombat", &["color"]), None);
    // At an entity, and at a light that has it.
    assert_eq!(by_meaning("position", &["sphere", "transform"]).map(|hit| hit.0), Some("transform"));
    assert_eq!(by_meaning("scale", &["sphere", "transform"]).map(|hit| hit.0), Some("transform"));
    assert_eq!(by_meaning("color", &["sphere", "material"]).map(|hit| hit.0), Some("material"));
    assert_eq!(by_meaning("Glass", &["Lambert", "Dielectric"]).map(|hit| hit.0), Some("Dielectric"));
}

#[test]
fn foreign_words_are_written_plainly() {
    for word in MEANINGS.iter().flat_map(|meaning| meaning.foreign) {
        assert!(word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit()), "{word}");
    }
}
