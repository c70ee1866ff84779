//! Material libraries of OBJ files.
//!
//! The classic fields are a Blinn-Phong material: `Kd`, `Ks` and `Ns` are its colour, highlight and exponent, `illum` says
//! whether it mirrors, `d` or `Tr` how much goes through it, `Ni` its index of refraction, `Ke` what it sends out. `Ka` is
//! a share of an ambient light, which no scene here has: only one that somebody has chosen is told of.

use glam::DVec3;

use crate::base::limits;
use crate::components::*;
use crate::load::mesh::cursor::{Cursor, Number};
use crate::load::mesh::source::{Notes, SourceFile, decode};

/// A material as its library has it.
pub struct Definition {
    pub name: String,
    /// Without its maps.
    pub material: Material,
    pub maps: Vec<Map>,
    /// Where its name stands.
    pub span: [usize; 2],
}

/// A map of a material.
pub struct Map {
    pub slot: Slot,
    /// The file's name as it is written.
    pub file: String,
    /// All but the image.
    pub texture: Texture,
    /// Where the statement stands.
    pub span: [usize; 2],
}

/// What a map varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    Color,
    Specular,
    Roughness,
    /// Linear, as `d`: how much of the surface is there.
    Opacity,
    Emission,
    /// A height, or a normal map under the name of one.
    Bump,
    Normal,
}

/// The statements of one material.
#[derive(Clone, Default)]
struct Fields {
    diffuse: Option<DVec3>,
    specular: Option<DVec3>,
    emission: Option<DVec3>,
    filter: Option<DVec3>,
    ambient: Option<DVec3>,
    /// Where `Tf` and `Ka` stand.
    filter_span: [usize; 2],
    ambient_span: [usize; 2],
    exponent: Option<f64>,
    dissolve: Option<f64>,
    transparency: Option<f64>,
    ior: Option<f64>,
    illumination: Option<f64>,
    roughness: Option<f64>,
    metallic: Option<f64>,
}

struct MtlReader<'a> {
    source: SourceFile<'a>,
    cursor: Cursor<'a>,
    found: Vec<Definition>,
    fields: Fields,
    /// Whether a `newmtl` was met.
    open: bool,
}

/// Reads a library. What makes no sense in it is noted and left out: a mesh without its colours still shows.
pub fn parse(source: SourceFile, notes: &mut Notes) -> Vec<Definition> {
    let mut reader = MtlReader {
        source,
        cursor: Cursor::new(source.bytes),
        found: Vec::new(),
        fields: Fields::default(),
        open: false,
    };
    while reader.cursor.peek().is_some() {
        reader.cursor.blanks();
        if !reader.cursor.at_end() {
            reader.statement(notes);
        }
        reader.cursor.skip_line();
    }
    reader.close(notes);
    reader.found
}

impl MtlReader<'_> {
    fn statement(&mut self, notes: &mut Notes) {
        let start = self.cursor.at;
        let word = decode(self.cursor.word());
        let key = word.to_ascii_lowercase();
        if key == "newmtl" {
            self.close(notes);
            let [start, end] = self.cursor.rest();
            let name = decode(&self.source.bytes[start..end]);
            self.open = self.found.len() < limits::MATERIALS;
            if self.open {
                let material = Material::default();
                self.found.push(Definition { name, material, maps: Vec::new(), span: [start, end] });
            }
            return;
        }
        if !self.open {
            return notes.add("before newmtl", || {
                let message = format!(
                    "`{}` before any `newmtl` belongs to no material",
                    self.source.short(start, self.cursor.at)
                );
                self.source.error(start, self.cursor.at, message).into_warning()
            });
        }
        let fields = &mut self.fields;
        let number = match key.as_str() {
            "ns" => Some(&mut fields.exponent),
            "d" => Some(&mut fields.dissolve),
            "tr" => Some(&mut fields.transparency),
            "ni" => Some(&mut fields.ior),
            "illum" => Some(&mut fields.illumination),
            "pr" => Some(&mut fields.roughness),
            "pm" => Some(&mut fields.metallic),
            _ => None,
        };
        if let Some(slot) = number {
            // `d -halo 0.5` dissolves by the angle; the number is what is left of it.
            let back = self.cursor;
            self.cursor.blanks();
            if self.cursor.word() != b"-halo" {
                self.cursor = back;
            }
            match self.cursor.number() {
                Number::Value(x) if x.is_finite() => *slot = Some(x),
                _ => self.senseless(&word, start, notes),
            }
            return;
        }
        let color = match key.as_str() {
            "kd" => Some(&mut fields.diffuse),
            "ks" => Some(&mut fields.specular),
            "ke" => Some(&mut fields.emission),
            "tf" => {
                fields.filter_span = [start, self.cursor.at];
                Some(&mut fields.filter)
            }
            "ka" => {
                fields.ambient_span = [start, self.cursor.at];
                Some(&mut fields.ambient)
            }
            _ => None,
        };
        if let Some(slot) = color {
            match color_of(&mut self.cursor) {
                Some(value) => *slot = Some(value),
                None => self.senseless(&word, start, notes),
            }
            return;
        }
        match key.as_str() {
            "map_kd" => self.map(Slot::Color, start, notes),
            "map_ks" => self.map(Slot::Specular, start, notes),
            "map_pr" => self.map(Slot::Roughness, start, notes),
            "map_d" => self.map(Slot::Opacity, start, notes),
            "map_ke" => self.map(Slot::Emission, start, notes),
            "bump" | "map_bump" => self.map(Slot::Bump, start, notes),
            "norm" | "map_kn" | "map_norm" => self.map(Slot::Normal, start, notes),
            _ => self.unused(&word, &key, start, notes),
        }
    }

    fn unused(&mut self, word: &str, key: &str, start: usize, notes: &mut Notes) {
        let known = ["ps", "pc", "pcr", "aniso", "anisor", "sharpness", "decal", "disp", "refl", "xyz", "spectral"];
        let short: String = word.chars().take(30).collect();
        // Exporters write these with nothing in them.
        let is_zero = ["ps", "pc", "pcr", "aniso", "anisor"].contains(&key)
            && matches!(Cursor { ..self.cursor }.number(), Number::Value(0.0));
        // The ambient map is the diffuse one once more.
        if is_zero || key == "map_ka" {
            return;
        }
        let message = match known.contains(&key) || key.starts_with("map_") {
            true => format!("`{short}` is not used"),
            false => format!("`{short}` is no statement of a material library; the line is skipped"),
        };
        notes.add(key, || self.source.error(start, start + word.len(), message).into_warning());
    }

    fn senseless(&self, word: &str, start: usize, notes: &mut Notes) {
        let [from, to] = Cursor { at: start, ..self.cursor }.rest();
        notes.add(&format!("{word} without sense"), || {
            let message = format!("`{}` makes no sense and is not used", self.source.short(from, to));
            self.source.error(from, to, message).into_warning()
        });
    }

    /// A map with its options; its file is what is left of the line.
    fn map(&mut self, slot: Slot, start: usize, notes: &mut Notes) {
        let mut texture = Texture::default();
        loop {
            self.cursor.blanks();
            let back = self.cursor;
            let option = self.cursor.word();
            if !option.starts_with(b"-") || option.len() < 2 || !option[1].is_ascii_alphabetic() {
                self.cursor = back;
                break;
            }
            self.option(&decode(option), back.at, slot, &mut texture, notes);
        }
        let [from, to] = self.cursor.rest();
        let file = decode(&self.source.bytes[from..to]);
        if file.is_empty() {
            return notes
                .add("map without file", || self.source.error(start, to, "this map names no file").into_warning());
        }
        if let Some(definition) = self.found.last_mut() {
            definition.maps.retain(|map| map.slot != slot);
            definition.maps.push(Map { slot, file, texture, span: [start, to] });
        }
    }

    fn option(&mut self, option: &str, start: usize, slot: Slot, texture: &mut Texture, notes: &mut Notes) {
        match option {
            "-o" => texture.offset = Axes(self.vector(0.0)),
            "-s" => {
                let scale = self.vector(1.0);
                texture.scale = Axes(scale.map(|x| if x == 0.0 { 1.0 } else { x }));
            }
            "-bm" => {
                let strength = self.vector(1.0).x;
                // A relief of no height is none, which `depth` cannot say.
                let strength = if strength == 0.0 { 1e-6 } else { strength };
                let unit = if slot == Slot::Normal { 1.0 } else { Texture::DEPTH };
                texture.depth = matches!(slot, Slot::Bump | Slot::Normal).then_some(strength * unit);
            }
            "-clamp" => {
                if self.flag() {
                    texture.wrap = Wrap::Clamp;
                }
            }
            "-mm" => {
                let [base, gain, _] = self.vector(1.0).to_array();
                texture.tint = DVec3::splat(gain.max(0.0));
                if base != 0.0 {
                    self.unused_option("-mm", start, notes);
                }
            }
            "-blendu" | "-blendv" | "-texres" => drop(self.word_after()),
            "-imfchan" if matches!(slot, Slot::Opacity | Slot::Roughness) => {
                texture.channel = match self.word_after().as_str() {
                    "r" => Channel::Red,
                    "g" => Channel::Green,
                    "b" => Channel::Blue,
                    "m" => Channel::Alpha,
                    _ => Channel::Color,
                };
            }
            "-t" | "-boost" => {
                self.vector(0.0);
                self.unused_option(option, start, notes);
            }
            _ => {
                drop(self.word_after());
                self.unused_option(option, start, notes);
            }
        }
    }

    fn unused_option(&self, option: &str, start: usize, notes: &mut Notes) {
        let message = format!("the option `{option}` is not used");
        notes.add(option, || self.source.error(start, start + option.len(), message).into_warning());
    }

    /// One to three numbers.
    fn vector(&mut self, rest: f64) -> DVec3 {
        let mut vector = DVec3::splat(rest);
        for i in 0..3 {
            let back = self.cursor;
            match self.cursor.number() {
                Number::Value(x) => vector[i] = if x.abs() <= 1e6 { x } else { rest },
                // A file of digits is hard to tell from a number; what ends the line is the file.
                Number::Word(..) | Number::Missing => {
                    self.cursor = back;
                    break;
                }
            }
        }
        vector
    }

    fn word_after(&mut self) -> String {
        self.cursor.blanks();
        decode(self.cursor.word())
    }

    fn flag(&mut self) -> bool {
        self.word_after().eq_ignore_ascii_case("on")
    }

    /// Ends the material at hand.
    fn close(&mut self, notes: &mut Notes) {
        let fields = std::mem::take(&mut self.fields);
        self.tell_unused(&fields, notes);
        if let Some(definition) = self.found.last_mut().filter(|_| self.open) {
            let colors = definition.maps.iter().find(|map| map.slot == Slot::Color).map(|map| map.file.clone());
            definition.material = fields.material(colors.is_some());
            for map in definition.maps.iter_mut().filter(|map| map.slot == Slot::Opacity) {
                // The picture of the colours a second time: what counts is how opaque it is.
                if colors.as_ref() == Some(&map.file) && map.texture.channel == Channel::Color {
                    map.texture.channel = Channel::Alpha;
                }
            }
            let glows = definition.maps.iter().any(|map| map.slot == Slot::Emission);
            if glows && definition.material.emission == DVec3::ZERO {
                definition.material.emission = DVec3::ONE;
            }
        }
        self.open = false;
    }

    /// What of a material has a sense that no picture shows.
    fn tell_unused(&self, fields: &Fields, notes: &mut Notes) {
        let mut tell = |kind: &str, [start, end]: [usize; 2], message: &str| {
            notes.add(kind, || self.source.error(start, end, message.to_string()).into_warning());
        };
        // Programs write black or white, or the colour once more, where nobody has chosen one.
        let is_chosen =
            |ambient: DVec3| ![DVec3::ZERO, DVec3::ONE].contains(&ambient) && Some(ambient) != fields.diffuse;
        if fields.ambient.is_some_and(is_chosen) {
            tell("ka", fields.ambient_span, "`Ka` is not used: no scene has an ambient light");
        }
        let Some(filter) = fields.filter else { return };
        if filter.max_element() != filter.min_element() {
            tell("tf", fields.filter_span, "the colour of `Tf` is not used, only how bright it is");
        } else if filter != DVec3::ONE && !fields.is_filtered() {
            tell("tf", fields.filter_span, "`Tf` is not used: only what refracts light and has no `d` is filtered");
        }
    }
}

/// `r g b`, or one number for all three; `xyz` and `spectral` are no colours that are read.
fn color_of(cursor: &mut Cursor) -> Option<DVec3> {
    let value = |x: f64| if x.is_finite() { Some(x.clamp(0.0, 1e6)) } else { None };
    let Number::Value(red) = cursor.number() else { return None };
    let back = *cursor;
    let (Number::Value(green), Number::Value(blue)) = (cursor.number(), cursor.number()) else {
        *cursor = back;
        return value(red).map(DVec3::splat);
    };
    Some(DVec3::new(value(red)?, value(green)?, value(blue)?))
}

impl Fields {
    /// How much of the surface is there, 0 to 1.
    fn dissolved(&self) -> f64 {
        self.dissolve.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0)
    }

    fn refracts(&self) -> bool {
        self.illumination.is_some_and(|illumination| [4.0, 6.0, 7.0, 9.0].contains(&illumination))
    }

    /// Whether `Tf` says what goes through.
    fn is_filtered(&self) -> bool {
        let is_physical = self.roughness.is_some() || self.metallic.is_some();
        self.refracts() && self.dissolved() == 1.0 && !is_physical
    }

    /// The material that the fields describe; `textured` says whether its colour has a map.
    fn material(self, textured: bool) -> Material {
        let dissolve = self.dissolved();
        let illumination = self.illumination.unwrap_or(2.0);
        let diffuse = self.diffuse.unwrap_or(DVec3::splat(0.8));
        // Black under a picture shows nothing: programs write it where only the picture counts.
        let color = if textured && (self.diffuse.is_none() || diffuse == DVec3::ZERO) { DVec3::ONE } else { diffuse };
        let emission = self.emission.unwrap_or(DVec3::ZERO);
        let ior = self.ior.filter(|ior| (0.001..=100.0).contains(ior)).unwrap_or(1.0);
        if self.roughness.is_some() || self.metallic.is_some() {
            return self.physical(color, dissolve, emission);
        }
        let specular = self.specular.filter(|_| illumination != 0.0 && illumination != 1.0).unwrap_or(DVec3::ZERO);
        let refracts = self.refracts();
        let through = match self.filter {
            Some(filter) if self.is_filtered() => filter.max_element().min(1.0),
            _ => 1.0 - dissolve,
        };
        Material {
            color,
            diffuse: if refracts { 1.0 - through } else { dissolve },
            specular_color: if specular == DVec3::ZERO { DVec3::ONE } else { specular },
            specular: if specular == DVec3::ZERO { 0.0 } else { 1.0 },
            shininess: self.exponent.unwrap_or(20.0).clamp(0.0, 1e6),
            reflection: (specular != DVec3::ZERO && illumination < 3.0).then_some(0.0),
            transmission: through,
            ior: refracts.then_some(ior),
            emission,
            ..Material::default()
        }
    }

    /// The fields of the physically based extension: `Pr` roughness, `Pm` metallic.
    fn physical(&self, color: DVec3, dissolve: f64, emission: DVec3) -> Material {
        let metallic = self.metallic.unwrap_or(0.0).clamp(0.0, 1.0);
        let roughness = self.roughness.unwrap_or(0.5).clamp(0.0, 1.0);
        let ior = self.ior.filter(|ior| (1.001..=100.0).contains(ior)).unwrap_or(1.5);
        let model = match metallic {
            0.0 => Model::Plastic,
            1.0 => Model::Conductor,
            _ => Model::Principled,
        };
        let color = color.min(DVec3::ONE);
        let opacity = dissolve;
        Material { model, color, metallic, roughness, ior: Some(ior), opacity, emission, ..Material::default() }
    }
}

#[cfg(test)]
mod tests;
