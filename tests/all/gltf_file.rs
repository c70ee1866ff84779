//! glTF files as tests write them: numbers go into one buffer, the rest is JSON.

/// A file that is being written.
#[derive(Default)]
pub struct GltfFile {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl GltfFile {
    /// Adds bytes as a view; its number.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let (start, length) = (self.bytes.len(), bytes.len());
        self.bytes.extend(bytes);
        self.views.push(format!(r#"{{"buffer": 0, "byteOffset": {start}, "byteLength": {length}}}"#));
        self.views.len() - 1
    }

    /// Adds an accessor over such a view; its number.
    pub fn accessor(&mut self, json: String) -> usize {
        self.accessors.push(json);
        self.accessors.len() - 1
    }

    /// Adds floats as elements of a type: `SCALAR`, `VEC3`, `MAT4`.
    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (view, count) = (self.view(&bytes), values.len() / width);
        self.accessor(format!(r#"{{"bufferView": {view}, "componentType": 5126, "count": {count}, "type": "{kind}"}}"#))
    }

    /// Adds whole numbers of two bytes each.
    pub fn shorts(&mut self, kind: &str, values: &[u16]) -> usize {
        let width = if kind == "VEC4" { 4 } else { 1 };
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (view, count) = (self.view(&bytes), values.len() / width);
        self.accessor(format!(r#"{{"bufferView": {view}, "componentType": 5123, "count": {count}, "type": "{kind}"}}"#))
    }

    fn json(&self, rest: &str, uri: &str) -> String {
        format!(
            "{{\"asset\": {{\"version\": \"2.0\"}},\n\"buffers\": [{{\"byteLength\": {}{uri}}}],\n\
             \"bufferViews\": [{}],\n\"accessors\": [{}],\n{rest}}}",
            self.bytes.len(),
            self.views.join(", "),
            self.accessors.join(", "),
        )
    }

    /// The text of a .gltf whose buffer is in it; `rest` are the other members of the JSON.
    pub fn text(&self, rest: &str) -> String {
        self.json(rest, &format!(", \"uri\": \"data:application/octet-stream;base64,{}\"", base64(&self.bytes)))
    }

    /// The bytes of a .glb.
    pub fn binary(&self, rest: &str) -> Vec<u8> {
        let json = self.json(rest, "");
        let padded = |n: usize| n.next_multiple_of(4);
        let (json_length, length) = (padded(json.len()), padded(self.bytes.len()));
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend(((28 + json_length + length) as u32).to_le_bytes());
        out.extend((json_length as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(json.bytes());
        out.resize(20 + json_length, b' ');
        out.extend((length as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(&self.bytes);
        out.resize(28 + json_length + length, 0);
        out
    }
}

/// Bytes as a data URI holds them.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let three = |chunk: &[u8]| {
        let word = (0..3).fold(0u32, |word, i| word << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        let digit = |i: usize| char::from(DIGITS[(word >> (18 - 6 * i) & 63) as usize]);
        (0..4).map(|i| if i <= chunk.len() { digit(i) } else { '=' }).collect::<String>()
    };
    bytes.chunks(3).map(three).collect()
}
