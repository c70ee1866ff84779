//! Stanford PLY, ASCII or binary: elements `vertex` and `face`.

use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult};

use crate::base::limits;
use crate::components::MeshData;

/// What is kept of one element, whichever it is.
struct PlyElement {
    position: Vec3,
    normal: Option<Vec3>,
    uv: Option<Vec2>,
    corners: Vec<i64>,
}

impl PropertyAccess for PlyElement {
    fn new() -> Self {
        PlyElement { position: Vec3::ZERO, normal: None, uv: None, corners: Vec::new() }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if let "vertex_indices" | "vertex_index" = name {
            self.corners = indices(&property);
            return PropertyAccessResult::Set;
        }
        let Some(x) = property.to_f32_lossy() else { return PropertyAccessResult::Ignored };
        match name {
            "x" => self.position.x = x,
            "y" => self.position.y = x,
            "z" => self.position.z = x,
            "nx" => self.normal.get_or_insert_default().x = x,
            "ny" => self.normal.get_or_insert_default().y = x,
            "nz" => self.normal.get_or_insert_default().z = x,
            "u" | "s" | "texture_u" => self.uv.get_or_insert_default().x = x,
            "v" | "t" | "texture_v" => self.uv.get_or_insert_default().y = x,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn indices(property: &Property) -> Vec<i64> {
    match property {
        Property::ListChar(v) => v.iter().map(|i| i64::from(*i)).collect(),
        Property::ListUChar(v) => v.iter().map(|i| i64::from(*i)).collect(),
        Property::ListShort(v) => v.iter().map(|i| i64::from(*i)).collect(),
        Property::ListUShort(v) => v.iter().map(|i| i64::from(*i)).collect(),
        Property::ListInt(v) => v.iter().map(|i| i64::from(*i)).collect(),
        Property::ListUInt(v) => v.iter().map(|i| i64::from(*i)).collect(),
        _ => Vec::new(),
    }
}

pub fn parse(bytes: &[u8]) -> Result<MeshData, String> {
    let mut reader = Reader::new(bytes);
    let parser = Parser::<PlyElement>::new();
    let header = parser.read_header(&mut reader).map_err(|e| e.to_string())?;
    let mut data = MeshData::default();
    for element in header.elements.values() {
        plausible(element, header.encoding, bytes.len())?;
        let rows = parser.read_payload_for_element(&mut reader, element, &header).map_err(|e| e.to_string())?;
        match element.name.as_str() {
            "vertex" => {
                data.vertices = rows.iter().map(|row| row.position).collect();
                data.normals = rows.iter().filter_map(|row| row.normal).collect();
                data.uvs = rows.iter().filter_map(|row| row.uv).collect();
            }
            "face" => {
                for row in &rows {
                    push_face(&row.corners, &mut data.triangles)?;
                }
            }
            _ => {}
        }
    }
    Ok(data)
}

/// A declared count is believed only if the file has room for it.
fn plausible(element: &ElementDef, encoding: Encoding, bytes: usize) -> Result<(), String> {
    let properties = element.properties.len().max(1);
    let least = if encoding == Encoding::Ascii { 2 * properties } else { properties };
    if element.count > bytes / least {
        let name = &element.name;
        return Err(format!("declares {} elements `{name}`, but has only {bytes} bytes", element.count));
    }
    Ok(())
}

/// A polygon as a fan of triangles.
fn push_face(corners: &[i64], triangles: &mut Vec<[u32; 3]>) -> Result<(), String> {
    if corners.len() > limits::POLYGON_VERTICES {
        return Err(format!("a face has {} corners", corners.len()));
    }
    let at = |i: usize| u32::try_from(corners[i]).map_err(|_| format!("vertex {} does not exist", corners[i]));
    for i in 2..corners.len() {
        triangles.push([at(0)?, at(i - 1)?, at(i)?]);
    }
    Ok(())
}
