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
fn parts_of_compounds_are_known() {
    assert_eq!(by_parts("use_denoising", &["size", "denoise"]).map(|hit| hit.0), Some("denoise"));
    assert_eq!(by_parts("PathTracer", &["Whitted", "Path"]).map(|hit| hit.0), Some("Path"));
    assert_eq!(by_parts("resolution_x", &["size", "samples"]).map(|hit| hit.0), Some("size"));
    assert_eq!(by_parts("diffuse_reflectance", &["color", "diffuse"]).map(|hit| hit.0), Some("color"));
    assert_eq!(by_parts("wombat_farm", &["color"]), None);
    assert_eq!(by_parts("color", &["color"]), None);
}

#[test]
fn foreign_words_are_written_plainly() {
    for word in MEANINGS.iter().chain(PICTURE).chain(FUNCTIONS).flat_map(|meaning| meaning.foreign) {
        assert!(word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit()), "{word}");
    }
}
