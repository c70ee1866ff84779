//! EXT_meshopt_compression: buffer views as their encoder wrote them -> plain bytes.
//!
//! Source: the bitstream appendix of the extension's specification. Everything is checked against the length of what
//! is there, so that a broken stream is an error and never more memory than it declares to fill.

use crate::base::limits;

/// How a view was compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshoptMode {
    Attributes,
    Triangles,
    Indices,
}

/// What is done to the elements once they are decompressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshoptFilter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

const SHORT: &str = "the compressed data end too early";

/// Decodes `count` elements of `stride` bytes.
///
/// # Errors
/// What is wrong with the stream or its declaration.
pub fn decode(
    data: &[u8],
    count: usize,
    stride: usize,
    mode: MeshoptMode,
    filter: MeshoptFilter,
) -> Result<Vec<u8>, String> {
    let size = count.checked_mul(stride).filter(|size| *size as u64 <= limits::MESH_FILE_BYTES);
    let size = size.ok_or("the compressed view declares more bytes than a file may have")?;
    let index = matches!(mode, MeshoptMode::Triangles | MeshoptMode::Indices);
    if index && !matches!(stride, 2 | 4) {
        return Err(format!("compressed indices have 2 or 4 bytes, not {stride}"));
    }
    let mut bytes = match mode {
        MeshoptMode::Attributes => attributes(data, count, stride, size)?,
        MeshoptMode::Triangles => packed(&triangles(data, count)?, stride),
        MeshoptMode::Indices => packed(&indices(data, count)?, stride),
    };
    match filter {
        MeshoptFilter::None => {}
        MeshoptFilter::Octahedral if stride == 4 => octahedral::<1>(&mut bytes),
        MeshoptFilter::Octahedral if stride == 8 => octahedral::<2>(&mut bytes),
        MeshoptFilter::Quaternion if stride == 8 => quaternion(&mut bytes),
        MeshoptFilter::Exponential if stride.is_multiple_of(4) => exponential(&mut bytes),
        _ => return Err(format!("the filter of a compressed view does not go with {stride} bytes an element")),
    }
    Ok(bytes)
}

fn packed(indices: &[u32], stride: usize) -> Vec<u8> {
    if stride == 2 {
        return indices.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect();
    }
    indices.iter().flat_map(|i| i.to_le_bytes()).collect()
}

/// Bytes that are taken from the front.
struct Stream<'a>(&'a [u8]);

impl<'a> Stream<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(n).ok_or(SHORT)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        self.take(1).map(|b| b[0])
    }

    /// Seven bits a byte, the lowest first.
    fn varint(&mut self) -> Result<u32, String> {
        let mut value = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("a compressed number is too long".into())
    }
}

/// Even numbers stand for themselves halved, odd ones for what lies below zero.
fn unzigzag(v: u32) -> u32 {
    if v & 1 != 0 { !(v >> 1) } else { v >> 1 }
}

/// Elements in one block, which is decoded byte by byte of the element.
fn block_elements(stride: usize) -> usize {
    ((8192 / stride) & !15).min(256)
}

fn attributes(data: &[u8], count: usize, stride: usize, size: usize) -> Result<Vec<u8>, String> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!("compressed attributes have 4 to 256 bytes, a multiple of 4, not {stride}"));
    }
    let Some((0xa0, data)) = data.split_first().map(|(head, rest)| (*head, rest)) else {
        return Err("the compressed attributes do not start with their sign".into());
    };
    let tail = stride.max(32);
    let body = data.len().checked_sub(tail).ok_or(SHORT)?;
    let mut last: Vec<u8> = data[data.len() - stride..].to_vec();
    let mut stream = Stream(&data[..body]);
    // A group of sixteen equal bytes takes two bits: nothing is filled that the stream has not the bits for.
    if count.div_ceil(16).saturating_mul(stride) / 4 > body {
        return Err(SHORT.into());
    }
    let mut bytes = vec![0; size];
    let most = block_elements(stride);
    let mut column = [0u8; 256];
    let mut start = 0;
    while start < count {
        let elements = most.min(count - start);
        for (k, last) in last.iter_mut().enumerate() {
            deltas(&mut stream, &mut column[..elements.next_multiple_of(16)])?;
            for (i, delta) in column[..elements].iter().enumerate() {
                let delta = if delta & 1 != 0 { !(delta >> 1) } else { delta >> 1 };
                *last = last.wrapping_add(delta);
                bytes[(start + i) * stride + k] = *last;
            }
        }
        start += elements;
    }
    Ok(bytes)
}

/// One byte of each element of a block, as zigzag differences, in groups of sixteen.
fn deltas(stream: &mut Stream, column: &mut [u8]) -> Result<(), String> {
    let header = stream.take((column.len() / 16).div_ceil(4))?;
    for (group, sixteen) in column.chunks_exact_mut(16).enumerate() {
        match header[group / 4] >> (group % 4 * 2) & 3 {
            0 => sixteen.fill(0),
            3 => sixteen.copy_from_slice(stream.take(16)?),
            1 => sentinels::<2>(stream, sixteen)?,
            _ => sentinels::<4>(stream, sixteen)?,
        }
    }
    Ok(())
}

/// Differences of a few bits each, those that need more as whole bytes behind them.
fn sentinels<const BITS: usize>(stream: &mut Stream, sixteen: &mut [u8]) -> Result<(), String> {
    let packed = stream.take(2 * BITS)?;
    let sign = (1u8 << BITS) - 1;
    let each = 8 / BITS;
    for (i, out) in sixteen.iter_mut().enumerate() {
        let value = packed[i / each] >> (8 - BITS * (i % each + 1)) & sign;
        *out = if value == sign { stream.byte()? } else { value };
    }
    Ok(())
}

/// What a decoder of triangles remembers.
#[derive(Default)]
struct IndexDecoder {
    next: u32,
    last: u32,
    edges: [[u32; 2]; 16],
    edge_at: usize,
    vertices: [u32; 16],
    vertex_at: usize,
}

impl IndexDecoder {
    fn edge(&self, back: usize) -> [u32; 2] {
        self.edges[self.edge_at.wrapping_sub(1 + back) & 15]
    }

    fn vertex(&self, back: usize) -> u32 {
        self.vertices[self.vertex_at.wrapping_sub(1 + back) & 15]
    }

    fn push_edge(&mut self, a: u32, b: u32) {
        self.edges[self.edge_at & 15] = [a, b];
        self.edge_at = self.edge_at.wrapping_add(1);
    }

    fn push_vertex(&mut self, v: u32) {
        self.vertices[self.vertex_at & 15] = v;
        self.vertex_at = self.vertex_at.wrapping_add(1);
    }

    fn fresh(&mut self) -> u32 {
        let next = self.next;
        self.next = next.wrapping_add(1);
        next
    }

    fn explicit(&mut self, data: &mut Stream) -> Result<u32, String> {
        self.last = self.last.wrapping_add(unzigzag(data.varint()?));
        Ok(self.last)
    }

    /// A triangle on an edge that was met before.
    fn on_edge(&mut self, code: u8, data: &mut Stream) -> Result<[u32; 3], String> {
        let [a, b] = self.edge(usize::from(code >> 4));
        let c = match code & 15 {
            0 => self.fresh(),
            low @ 1..=12 => self.vertex(usize::from(low)),
            low @ (13 | 14) => {
                self.last = if low == 13 { self.last.wrapping_sub(1) } else { self.last.wrapping_add(1) };
                self.last
            }
            _ => self.explicit(data)?,
        };
        self.push_edge(c, b);
        self.push_edge(a, c);
        if !(1..=12).contains(&(code & 15)) {
            self.push_vertex(c);
        }
        Ok([a, b, c])
    }

    /// A triangle without one: each corner is new, was met before, or is written out.
    fn apart(&mut self, code: u8, table: &[u8], data: &mut Stream) -> Result<[u32; 3], String> {
        let low = code & 15;
        let corners = if low < 14 { table[usize::from(low)] } else { data.byte()? };
        if low >= 14 && corners == 0 {
            self.next = 0;
        }
        let a = if low == 15 { self.explicit(data)? } else { self.fresh() };
        let mut corner = |this: &mut Self, from: u8| match from {
            0 => Ok((this.fresh(), true)),
            15 if low >= 14 => this.explicit(data).map(|v| (v, true)),
            back => Ok((this.vertex(usize::from(back) - 1), false)),
        };
        let (b, b_is_new) = corner(self, corners >> 4)?;
        let (c, c_is_new) = corner(self, corners & 15)?;
        self.push_edge(b, a);
        self.push_edge(c, b);
        self.push_edge(a, c);
        self.push_vertex(a);
        if b_is_new {
            self.push_vertex(b);
        }
        if c_is_new {
            self.push_vertex(c);
        }
        Ok([a, b, c])
    }
}

fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if !count.is_multiple_of(3) {
        return Err(format!("{count} compressed indices make no triangles"));
    }
    let Some((0xe1, data)) = data.split_first().map(|(head, rest)| (*head, rest)) else {
        return Err("the compressed triangles do not start with their sign".into());
    };
    let body = data.len().checked_sub(16).ok_or(SHORT)?;
    let (data, table) = data.split_at(body);
    let (codes, data) = data.split_at_checked(count / 3).ok_or(SHORT)?;
    let (mut corners, mut data) = (IndexDecoder::default(), Stream(data));
    let mut out = Vec::with_capacity(count);
    for code in codes {
        let on_edge = code >> 4 < 15;
        let triangle =
            if on_edge { corners.on_edge(*code, &mut data)? } else { corners.apart(*code, table, &mut data)? };
        out.extend(triangle);
    }
    Ok(out)
}

fn indices(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let Some((0xd1, data)) = data.split_first().map(|(head, rest)| (*head, rest)) else {
        return Err("the compressed indices do not start with their sign".into());
    };
    let body = data.len().checked_sub(4).ok_or(SHORT)?;
    if count > body {
        return Err(SHORT.into());
    }
    let mut stream = Stream(&data[..body]);
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let code = stream.varint()?;
        let base = &mut last[(code & 1) as usize];
        *base = base.wrapping_add(unzigzag(code >> 1));
        out.push(*base);
    }
    Ok(out)
}

/// The nearest whole number, halves away from zero.
fn rounded(x: f32) -> i32 {
    (x + if x >= 0.0 { 0.5 } else { -0.5 }) as i32
}

/// Unit vectors from two coordinates on an octahedron; components of `BYTES` bytes, the fourth is left alone.
fn octahedral<const BYTES: usize>(bytes: &mut [u8]) {
    let read = |at: &[u8]| -> f32 {
        if BYTES == 1 { f32::from(at[0] as i8) } else { f32::from(i16::from_le_bytes([at[0], at[1]])) }
    };
    let most = if BYTES == 1 { 127.0 } else { 32_767.0 };
    for element in bytes.chunks_exact_mut(4 * BYTES) {
        let [x, y, one] = [0, 1, 2].map(|k| read(&element[k * BYTES..]));
        let (x, y) = if one == 0.0 { (0.0, 0.0) } else { (x / one, y / one) };
        let z = 1.0 - x.abs() - y.abs();
        // Below the equator the corners of the octahedron are folded in.
        let folded = (-z).max(0.0);
        let (x, y) = (x - folded.copysign(x), y - folded.copysign(y));
        let length = (x * x + y * y + z * z).sqrt().max(f32::MIN_POSITIVE);
        for (k, v) in [x, y, z].into_iter().enumerate() {
            let value = rounded(v / length * most);
            element[k * BYTES..(k + 1) * BYTES].copy_from_slice(&value.to_le_bytes()[..BYTES]);
        }
    }
}

/// Unit quaternions from the three components that are not the largest.
fn quaternion(bytes: &mut [u8]) {
    for element in bytes.chunks_exact_mut(8) {
        let part = |k: usize| i16::from_le_bytes([element[2 * k], element[2 * k + 1]]);
        let code = part(3);
        let one = f32::from(code | 3);
        let [x, y, z] = [0, 1, 2].map(|k| f32::from(part(k)) / one * std::f32::consts::FRAC_1_SQRT_2);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let largest = (code & 3) as usize;
        for (k, v) in [w, x, y, z].into_iter().enumerate() {
            let at = 2 * ((largest + k) % 4);
            element[at..at + 2].copy_from_slice(&(rounded(v * 32_767.0) as i16).to_le_bytes());
        }
    }
}

/// Floats from a mantissa of 24 bits and an exponent of 8.
fn exponential(bytes: &mut [u8]) {
    for element in bytes.chunks_exact_mut(4) {
        let code = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
        let (exponent, mantissa) = (code >> 24, (code << 8) >> 8);
        let value = libm::ldexpf(mantissa as f32, exponent);
        element.copy_from_slice(&value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(hex: &str) -> Vec<u8> {
        (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
    }

    /// The example of the specification: sixteen differences of four bits with two that did not fit.
    #[test]
    fn differences_are_those_of_the_specifications_example() {
        let bytes = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let mut sixteen = [0; 16];
        sentinels::<4>(&mut Stream(&bytes), &mut sixteen).unwrap();
        let signed = sixteen.map(|d| if d & 1 != 0 { !(d >> 1) } else { d >> 1 } as i8);
        assert_eq!(signed, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
    }

    #[test]
    fn numbers_have_seven_bits_a_byte_the_lowest_first() {
        let read = |bytes: &[u8]| Stream(bytes).varint();
        assert_eq!([read(&[0x7f]), read(&[0x81, 0x04]), read(&[0xff, 0xa0, 0x05])], [Ok(0x7f), Ok(0x201), Ok(0x1507f)]);
        assert!(read(&[0xff; 6]).is_err() && read(&[0x80]).is_err());
    }

    // The streams below were written by meshoptimizer 0.22 for these values.

    const ATTRIBUTES: &str = "a02a0666666666666666666666666666666666666666000000002a0666666666666666666666666666666666666666000000\
                        002a0666666666666666666666666666666666666666000000002a0666666666666666666666666666666666666666000000\
                        002b00111407111817140a05041b060c11082c6017879ef03fb90f1c4880f8a000000000131a0e3fc56e37713e091744c2f0\
                        45ff81ff691512111013f1f3000018171e1b1c1a041ca725b8c920ef135fd02c330d40344d1ef33d000004080405122a011f\
                        475c7f0a190f181110fc64109fb83fc1830f140f8d9ffe3a00000000181700001f00f71b9b6ff5569895ebd48fff3d31a566\
                        b1a69f1df34059958996ce7bbe563dffff0000bc8347dcfa2919db1f0024867dcce7d7818d592cf8e7de8a6649d10dd008af\
                        a566e3bde033556016faffff000075504a2ae3dcd4840000000000000000000000000000000000000000000102030c080003\
                        050536e6";

    /// Forty elements of twelve bytes: a ramp, small numbers, a constant, noise.
    fn elements() -> Vec<u8> {
        let mut state = 7u32;
        let mut byte = |i: usize, k: usize| {
            // In the doubles of the language that wrote the stream, this product is rounded.
            state = (f64::from(state) * 1_103_515_245.0 + 12_345.0).rem_euclid(4_294_967_296.0) as u32;
            match k {
                0..=3 => (i * 3 + k) as u8,
                4..=7 => (state >> 28) as u8,
                8..=9 => 5,
                _ => (state >> 24) as u8,
            }
        };
        (0..40).flat_map(|i| (0..12).map(move |k| (i, k))).map(|(i, k)| byte(i, k)).collect()
    }

    #[test]
    fn attributes_come_back() {
        let stream = bytes(ATTRIBUTES);
        let read = |data: &[u8], count| decode(data, count, 12, MeshoptMode::Attributes, MeshoptFilter::None);
        assert_eq!(read(&stream, 40), Ok(elements()));
        for cut in 0..stream.len() {
            // Cut short it is an error or other values, never a panic.
            let _ = read(&stream[..cut], 40);
        }
        assert!(read(&stream, 1 << 40).is_err() && read(&stream, 1 << 20).is_err());
    }

    const TRIANGLES: &str = "e1fe1e100e100e100e100efe1e190e180e170e160eff1e160e160e160e160eff1e160e160e160e160eff1e160e160e160e16\
                        0efeff0f0c9f025f090c5f090c5f090cf145ffe807d8b002b9b802007687566778a9866589689801690000";

    #[test]
    fn triangles_come_back() {
        let mut expected = Vec::new();
        for corner in (0..5).flat_map(|y| (0..5).map(move |x| y * 6 + x)) {
            expected.extend([[corner, corner + 1, corner + 6], [corner + 6, corner + 1, corner + 7]]);
        }
        expected.extend([[0, 35, 7], [500, 20_000, 3]]);
        let stream = bytes(TRIANGLES);
        // IndexDecoder may be turned so that the stream gets shorter; the sense of rotation stays.
        let turned = |t: &[u32; 3]| (0..3).map(|i| [t[i], t[(i + 1) % 3], t[(i + 2) % 3]]).min();
        let decoded = triangles(&stream, 3 * expected.len()).unwrap();
        let decoded: Vec<[u32; 3]> = decoded.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        assert_eq!(decoded.iter().map(turned).collect::<Vec<_>>(), expected.iter().map(turned).collect::<Vec<_>>());
        let expected = expected.as_flattened();
        let packed = decode(&stream, expected.len(), 2, MeshoptMode::Triangles, MeshoptFilter::None).unwrap();
        assert_eq!(packed[2 * 154..2 * 155], 20_000u16.to_le_bytes());
        for cut in 0..stream.len() {
            let _ = triangles(&stream[..cut], 156);
        }
        assert!(triangles(&stream, 7).is_err() && triangles(&stream, 3 << 40).is_err());
    }

    #[test]
    fn sequences_of_indices_come_back() {
        let stream = bytes("d100040404910304050405ac8b11ff0200000000");
        let expected = [0, 1, 2, 3, 100, 4, 101, 5, 102, 70_000, 6];
        assert_eq!(indices(&stream, 11).as_deref(), Ok(&expected[..]));
        assert!(indices(&stream, 12).is_err() && indices(&stream, 1 << 40).is_err());
    }

    #[test]
    fn filters_give_what_their_library_gives() {
        let after = |filter: &dyn Fn(&mut [u8]), hex: &str| {
            let mut bytes = bytes(hex);
            filter(&mut bytes);
            bytes
        };
        assert_eq!(
            after(&octahedral::<1>, "7f007f7f7f7f7f8150537f7fe4db7f7f"),
            bytes("7f00007f000081814c51c27fd2c3667f")
        );
        let sixteen = "ff070000ff07ff7fff07ff07ff07018005053505ff07ff7f3ffea9fdff07ff7f";
        assert_eq!(
            after(&octahedral::<2>, sixteen),
            bytes("ff7f00000000ff7f0000000001800180ca4cf35197c2ff7ff7d195c26e66ff7f")
        );
        let turns = "000000000000ff07a705a705a705fc07210116f8dffefd07000037f90000fc07";
        assert_eq!(
            after(&quaternion, turns),
            bytes("000000000000ff7f0f40fa3ffa3ffa3f39f39f59c70c6ca66566000033b30000")
        );
        let floats = after(&exponential, "001000f400d8fff4040000f40000001000000010b9290010");
        let values: Vec<f32> = floats.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(floats, bytes("0000803f000020c00000803a000000000000000000e4264e"), "{values:?}");
    }

    #[test]
    fn modes_filters_and_sizes_must_go_together() {
        let wrong = |stride, mode, filter| decode(&bytes(ATTRIBUTES), 40, stride, mode, filter).is_err();
        assert!(wrong(3, MeshoptMode::Attributes, MeshoptFilter::None));
        assert!(wrong(12, MeshoptMode::Attributes, MeshoptFilter::Octahedral));
        assert!(wrong(12, MeshoptMode::Attributes, MeshoptFilter::Quaternion));
        assert!(wrong(8, MeshoptMode::Triangles, MeshoptFilter::None));
        assert!(wrong(4, MeshoptMode::Indices, MeshoptFilter::None));
        assert!(wrong(0, MeshoptMode::Attributes, MeshoptFilter::None));
    }
}
