//! Statements of material libraries, and what becomes of them.

use super::*;

fn read(text: &str) -> (Vec<Definition>, Vec<String>) {
    let mut notes = Notes::default();
    let found = parse(SourceFile { file: "a.mtl", bytes: text.as_bytes() }, &mut notes);
    (found, notes.into_warnings().iter().map(ToString::to_string).collect())
}

fn one(text: &str) -> Material {
    let (mut found, warnings) = read(&format!("newmtl m\n{text}"));
    assert!(warnings.is_empty(), "{warnings:?}");
    let material = found.remove(0).material;
    material.check().unwrap();
    material
}

#[test]
fn classic_fields_are_a_blinn_phong_material() {
    let m = one("Ka 1 1 1\nKd 0.5 0.25 0.1\nKs 0.5 0.5 0.4\nNs 96\nNi 1.45\nd 1\nillum 2\nKe 0 0 2");
    assert_eq!((m.color, m.diffuse, m.shininess), (DVec3::new(0.5, 0.25, 0.1), 1.0, 96.0));
    assert_eq!((m.specular_color, m.specular, m.reflection), (DVec3::new(0.5, 0.5, 0.4), 1.0, Some(0.0)));
    assert_eq!((m.transmission, m.emission), (0.0, DVec3::Z * 2.0));
    assert_eq!(one("Ks 1 1 1\nillum 3").reflection, None);
    assert_eq!(one("Ks 1 1 1\nillum 1").specular, 0.0);
    assert_eq!(one("Kd 0.4").color, DVec3::splat(0.4));
}

#[test]
fn what_is_dissolved_lets_light_through() {
    let veil = one("d 0.25");
    assert_eq!((veil.transmission, veil.diffuse, veil.ior), (0.75, 0.25, None));
    assert_eq!(one("Tr 0.75"), one("d 0.25"));
    assert_eq!(one("d 0.25\nTr 0.1"), one("d 0.25"));
    let glass = one("illum 7\nNi 1.5\nd 0.1");
    assert_eq!((glass.transmission, glass.ior), (0.9, Some(1.5)));
    let filtered = one("illum 7\nNi 1.5\nd 1\nTf 1 1 1");
    assert_eq!((filtered.transmission, filtered.diffuse), (1.0, 0.0));
}

#[test]
fn physical_fields_are_a_physical_material() {
    assert_eq!((one("Pr 0.3").model, one("Pr 0.3").roughness), (Model::Plastic, 0.3));
    assert_eq!(one("Pr 0.3\nPm 1").model, Model::Conductor);
    let half = one("Pr 0.3\nPm 0.5\nd 0.25");
    assert_eq!((half.model, half.metallic, half.opacity), (Model::Principled, 0.5, 0.25));
}

#[test]
fn opacity_and_emission_have_maps() {
    let (found, warnings) = read(
        "newmtl m\nmap_d a.png\nmap_Ke glow.png\nnewmtl n\nmap_Kd leaf.png\nmap_d leaf.png\n\
         newmtl o\nmap_d -imfchan g b.png\n",
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let channels = |i: usize| found[i].maps.iter().map(|map| (map.slot, map.texture.channel)).collect::<Vec<_>>();
    assert_eq!(channels(0), [(Slot::Opacity, Channel::Color), (Slot::Emission, Channel::Color)]);
    assert_eq!(found[0].material.emission, DVec3::ONE);
    assert_eq!(channels(1), [(Slot::Color, Channel::Color), (Slot::Opacity, Channel::Alpha)]);
    assert_eq!(channels(2), [(Slot::Opacity, Channel::Green)]);
}

#[test]
fn what_no_picture_shows_of_a_material_is_told() {
    let (_, warnings) = read("newmtl a\nKd 1 0 0\nKa 1 0 0\nTf 1 1 1\nnewmtl b\nKa 0.2 0.1 0\nTf 0.5 0.5 0.5\n");
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].starts_with("a.mtl:6:1: warning: `Ka` is not used"), "{}", warnings[0]);
    assert!(warnings[1].starts_with("a.mtl:7:1: warning: `Tf` is not used"), "{}", warnings[1]);
    let (_, warnings) = read("newmtl a\nillum 7\nNi 1.5\nTf 1 0.5 0.5\n");
    assert!(warnings[0].contains("the colour of `Tf` is not used"), "{warnings:?}");
}

#[test]
fn maps_have_options_and_names_with_blanks() {
    let text = "newmtl m\nKd 0 0 0\nmap_Kd -s 2 3 1 -o 0.5 0 -clamp on -mm 0 0.5 wood floor.png # c\n\
                map_Bump -bm 0.5 b.png\nnorm -bm 2 n.png\n";
    let (found, warnings) = read(text);
    assert!(warnings.is_empty(), "{warnings:?}");
    let [color, bump, normal] = &found[0].maps[..] else { panic!() };
    assert_eq!((color.slot, color.file.as_str()), (Slot::Color, "wood floor.png"));
    assert_eq!(color.texture.scale, Axes(DVec3::new(2.0, 3.0, 1.0)));
    assert_eq!((color.texture.offset.0.x, color.texture.wrap), (0.5, Wrap::Clamp));
    assert_eq!(color.texture.tint, DVec3::splat(0.5));
    assert_eq!((bump.texture.depth, normal.texture.depth), (Some(0.01), Some(2.0)));
    assert_eq!(found[0].material.color, DVec3::ONE);
}

#[test]
fn what_is_not_used_is_said_once_with_its_place() {
    let (_, warnings) = read("Kd 1 1 1\nnewmtl a\nmap_disp d.png\nPs 0\nsheen 3\nKs red\nnewmtl b\nmap_disp e.png\n");
    let said = ["a.mtl:1:1: warning: `Kd` before any", "a.mtl:3:1: warning: `map_disp` is not used (2 times"];
    let more = ["a.mtl:5:1: warning: `sheen` is no statement", "a.mtl:6:1: warning: `Ks red` makes no sense"];
    assert_eq!(warnings.len(), 4, "{warnings:?}");
    for (warning, said) in warnings.iter().zip(said.iter().chain(&more)) {
        assert!(warning.starts_with(said), "{warning}");
    }
}
