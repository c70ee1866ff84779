//! Values as bytes, for another process of this same program: compact, exact to the bit, and never believed for a size.
//!
//! Numbers go as they are in memory, little end first; lengths and counts in seven bits a byte. Nothing is named or
//! versioned: both ends are one executable. What is shared by pointer and large goes once a message, and never if a message
//! that both ends keep in mind had it: where it comes again it is a number.

use std::any::Any;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;

use super::diagnostics::{Cause, Diagnostic, Diagnostics, Place, Severity};

/// Bytes that are not what was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;

/// Values that both ends have, by their number.
#[derive(Clone, Default)]
pub struct SharedTable {
    values: Vec<Arc<dyn Any + Send + Sync>>,
    /// How many of them outlast the message.
    kept: usize,
    numbers: FxHashMap<usize, u32>,
}

impl SharedTable {
    fn number<T>(&self, value: &Arc<T>) -> Option<u32> {
        self.numbers.get(&address(value)).copied()
    }

    fn add<T: Any + Send + Sync>(&mut self, value: &Arc<T>, keeps: bool) {
        self.numbers.insert(address(value), self.values.len() as u32);
        self.values.push(value.clone());
        if keeps {
            self.kept = self.values.len();
        }
    }

    /// Forgets what only the last message had.
    fn end_message(&mut self) {
        for value in self.values.drain(self.kept..) {
            self.numbers.remove(&address(&value));
        }
    }
}

/// The table holds what is at the address, so that nothing else can come to lie there.
fn address<T: ?Sized>(value: &Arc<T>) -> usize {
    Arc::as_ptr(value).addr()
}

/// Where values are written to.
#[derive(Default)]
pub struct Encoder {
    /// What is written so far.
    pub bytes: Vec<u8>,
    /// Values that were shared so far.
    pub table: SharedTable,
    /// Whether the other end keeps what is new in this message.
    pub teaches: bool,
}

impl Encoder {
    /// Makes room for another message.
    pub fn start_message(&mut self) {
        self.bytes.clear();
        self.table.end_message();
    }

    /// Writes a value behind what is there.
    pub fn put<T: Codec>(&mut self, value: &T) {
        value.encode(self);
    }

    /// A count or a number that mostly is small.
    pub fn count(&mut self, mut count: u64) {
        while count >= 0x80 {
            self.bytes.push(count as u8 | 0x80);
            count >>= 7;
        }
        self.bytes.push(count as u8);
    }

    /// A value that many may share: by its number if the other end has it.
    pub fn shared<T: Codec + Any + Send + Sync>(&mut self, value: &Arc<T>) {
        if let Some(number) = self.table.number(value) {
            return self.count(u64::from(number) + 1);
        }
        self.count(0);
        value.encode(self);
        self.table.add(value, self.teaches);
    }
}

/// Where values are read from.
pub struct Decoder<'a> {
    rest: &'a [u8],
    /// Values that were shared so far.
    pub table: SharedTable,
    /// Whether what is new in this message is kept for the next.
    pub learns: bool,
}

impl<'a> Decoder<'a> {
    /// Reads from `bytes`, with the table of the messages before.
    pub fn new(bytes: &'a [u8], table: SharedTable, learns: bool) -> Self {
        Decoder { rest: bytes, table, learns }
    }

    /// The next value.
    ///
    /// # Errors
    /// [`Malformed`] if the bytes are no such value.
    pub fn get<T: Codec>(&mut self) -> Result<T, Malformed> {
        T::decode(self)
    }

    /// The bytes that are left.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Malformed> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(Malformed)?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or(Malformed)?;
        self.rest = rest;
        Ok(*taken)
    }

    /// As [`Encoder::count`] wrote it.
    ///
    /// # Errors
    /// [`Malformed`] if the bytes end, or are no number of 64 bits.
    pub fn count(&mut self) -> Result<u64, Malformed> {
        let mut count = 0u64;
        for shift in (0..64).step_by(7) {
            let [byte] = self.array()?;
            count |= u64::from(byte & 0x7f).checked_shl(shift).ok_or(Malformed)?;
            if byte < 0x80 {
                return Ok(count);
            }
        }
        Err(Malformed)
    }

    /// As [`Encoder::shared`] wrote it.
    ///
    /// # Errors
    /// [`Malformed`] if the bytes are no such value, or name one that is not in the table.
    pub fn shared<T: Codec + Any + Send + Sync>(&mut self) -> Result<Arc<T>, Malformed> {
        let number = self.count()?;
        if number > 0 {
            let known = self.table.values.get(usize::try_from(number - 1).map_err(|_| Malformed)?);
            return known.cloned().ok_or(Malformed)?.downcast().map_err(|_| Malformed);
        }
        let value = Arc::new(T::decode(self)?);
        self.table.add(&value, self.learns);
        Ok(value)
    }
}

/// A value that can go to another process of this program and be there what it was, to the bit.
pub trait Codec: Sized {
    /// Writes the value.
    fn encode(&self, to: &mut Encoder);
    /// # Errors
    /// [`Malformed`] if the bytes are no such value.
    fn decode(from: &mut Decoder) -> Result<Self, Malformed>;
}

macro_rules! plain_numbers {
    ($($type:ty),*) => { $(
        impl Codec for $type {
            fn encode(&self, to: &mut Encoder) {
                to.bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
                from.array().map(<$type>::from_le_bytes)
            }
        }
    )* };
}
plain_numbers!(u8, u32, u64, i64, f32, f64);

macro_rules! vectors {
    ($($type:ty),*) => { $(
        impl Codec for $type {
            fn encode(&self, to: &mut Encoder) {
                self.to_array().iter().for_each(|x| to.put(x));
            }
            fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
                let mut axes = <$type>::default().to_array();
                for axis in &mut axes {
                    *axis = from.get()?;
                }
                Ok(<$type>::from_array(axes))
            }
        }
    )* };
}
vectors!(DVec2, DVec3, Vec2, Vec3, Vec4);

impl Codec for bool {
    fn encode(&self, to: &mut Encoder) {
        to.bytes.push(u8::from(*self));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        match from.get::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Malformed),
        }
    }
}

impl Codec for usize {
    fn encode(&self, to: &mut Encoder) {
        to.count(*self as u64);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.count()?.try_into().map_err(|_| Malformed)
    }
}

fn text<'a>(from: &mut Decoder<'a>) -> Result<&'a str, Malformed> {
    let length = from.get::<usize>()?;
    std::str::from_utf8(from.take(length)?).map_err(|_| Malformed)
}

impl Codec for String {
    fn encode(&self, to: &mut Encoder) {
        encode_text(self, to);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        text(from).map(str::to_string)
    }
}

impl Codec for Arc<str> {
    fn encode(&self, to: &mut Encoder) {
        encode_text(self, to);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        text(from).map(Arc::from)
    }
}

impl<T: Codec> Codec for Option<T> {
    fn encode(&self, to: &mut Encoder) {
        self.is_some().encode(to);
        self.iter().for_each(|value| value.encode(to));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        if from.get()? { T::decode(from).map(Some) } else { Ok(None) }
    }
}

impl<T: Codec> Codec for Box<T> {
    fn encode(&self, to: &mut Encoder) {
        T::encode(self, to);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        T::decode(from).map(Box::new)
    }
}

impl<T: Codec, const N: usize> Codec for [T; N] {
    fn encode(&self, to: &mut Encoder) {
        self.iter().for_each(|value| value.encode(to));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let values: Vec<T> = (0..N).map(|_| T::decode(from)).collect::<Result<_, _>>()?;
        values.try_into().map_err(|_| Malformed)
    }
}

impl<T: Codec> Codec for Vec<T> {
    fn encode(&self, to: &mut Encoder) {
        to.count(self.len() as u64);
        self.iter().for_each(|value| value.encode(to));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let count = from.get::<usize>()?;
        // A value takes a byte at least, so that room is never made for more than can be there.
        let mut values = Vec::with_capacity(count.min(from.left()).min(MOST_AT_ONCE));
        for _ in 0..count {
            values.push(T::decode(from)?);
        }
        Ok(values)
    }
}

/// Values that room is made for before they are read.
const MOST_AT_ONCE: usize = 4_096;

impl<A: Codec, B: Codec> Codec for (A, B) {
    fn encode(&self, to: &mut Encoder) {
        self.0.encode(to);
        self.1.encode(to);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok((A::decode(from)?, B::decode(from)?))
    }
}

fn encode_text(text: &str, to: &mut Encoder) {
    to.count(text.len() as u64);
    to.bytes.extend_from_slice(text.as_bytes());
}

impl Codec for Place {
    fn encode(&self, to: &mut Encoder) {
        let Place { file, line, column, width, source } = self;
        to.put(file);
        [line, column, width].into_iter().for_each(|number| to.put(number));
        to.put(source);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Place { file: from.get()?, line: from.get()?, column: from.get()?, width: from.get()?, source: from.get()? })
    }
}

const SEVERITIES: [Severity; 3] = [Severity::Error, Severity::Warning, Severity::Note];
const CAUSES: [Cause; 4] = [Cause::Input, Cause::Usage, Cause::Io, Cause::Interrupted];

/// The place of a word in the list of all.
fn encode_word<T: PartialEq>(word: &T, all: &[T], to: &mut Encoder) {
    let place = all.iter().position(|known| known == word);
    to.bytes.push(place.map_or(u8::MAX, |place| place as u8));
}

fn decode_word<T: Copy>(all: &[T], from: &mut Decoder) -> Result<T, Malformed> {
    all.get(usize::from(from.get::<u8>()?)).copied().ok_or(Malformed)
}

impl Codec for Diagnostic {
    fn encode(&self, to: &mut Encoder) {
        // What it is about is for who looks for its place, which the other end has done.
        let Diagnostic { severity, cause, message, place, help, about: _ } = self;
        encode_word(severity, &SEVERITIES, to);
        encode_word(cause, &CAUSES, to);
        to.put(message);
        to.put(place);
        to.put(help);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Diagnostic {
            severity: decode_word(&SEVERITIES, from)?,
            cause: decode_word(&CAUSES, from)?,
            message: from.get()?,
            place: from.get()?,
            help: from.get()?,
            about: None,
        })
    }
}

impl Codec for Diagnostics {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.0);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get().map(Diagnostics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn there_and_back<T: Codec>(value: &T) -> T {
        let mut encoder = Encoder::default();
        encoder.put(value);
        let mut decoder = Decoder::new(&encoder.bytes, SharedTable::default(), false);
        let back = decoder.get().unwrap_or_else(|Malformed| panic!("not what was written"));
        assert_eq!(decoder.left(), 0);
        back
    }

    #[test]
    fn numbers_keep_every_bit() {
        for x in [0.0, -0.0, f64::NAN, -f64::NAN, f64::MIN_POSITIVE / 3.0, f64::INFINITY, 1.0 / 3.0] {
            assert_eq!(there_and_back(&x).to_bits(), x.to_bits());
            let v = DVec3::new(x, -x, 1.0);
            assert_eq!(there_and_back(&v).to_array().map(f64::to_bits), v.to_array().map(f64::to_bits));
        }
        for n in [0, 127, 128, 16_384, usize::MAX] {
            assert_eq!(there_and_back(&n), n);
        }
    }

    #[test]
    fn what_was_sent_once_goes_as_a_number() {
        let mesh = Arc::new(vec![1.0f64; 1_000]);
        let mut encoder = Encoder { teaches: true, ..Encoder::default() };
        encoder.shared(&mesh);
        encoder.shared(&mesh);
        assert!(encoder.bytes.len() < 8_100);
        let mut decoder = Decoder::new(&encoder.bytes, SharedTable::default(), true);
        let [a, b] = [(); 2].map(|()| decoder.shared::<Vec<f64>>().unwrap());
        assert!(Arc::ptr_eq(&a, &b) && a == mesh);
    }

    #[test]
    fn what_a_message_alone_has_goes_once_in_each() {
        let [mesh, other] = [1.0f64, 2.0].map(|x| Arc::new(vec![x; 1_000]));
        let mut encoder = Encoder::default();
        for _ in 0..2 {
            encoder.start_message();
            for value in [&mesh, &other, &mesh, &other] {
                encoder.shared(value);
            }
            assert!((16_000..16_100).contains(&encoder.bytes.len()));
            let mut decoder = Decoder::new(&encoder.bytes, SharedTable::default(), false);
            let [a, b, c, d] = [(); 4].map(|()| decoder.shared::<Vec<f64>>().unwrap());
            assert!(Arc::ptr_eq(&a, &c) && Arc::ptr_eq(&b, &d) && a == mesh && d == other);
        }
    }

    #[test]
    fn no_count_is_believed() {
        let huge = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f];
        let decode = |bytes: &[u8]| Vec::<u64>::decode(&mut Decoder::new(bytes, SharedTable::default(), false));
        assert_eq!(decode(&huge), Err(Malformed));
        assert_eq!(decode(&[0xff; 20]), Err(Malformed));
        assert_eq!(String::decode(&mut Decoder::new(&[2, 0xff, 0xff], SharedTable::default(), false)), Err(Malformed));
    }

    proptest! {
        #[test]
        fn texts_and_lists_come_back(list in prop::collection::vec((any::<Option<u32>>(), ".{0,9}"), 0..9)) {
            prop_assert_eq!(there_and_back(&list), list);
        }

        #[test]
        fn any_bytes_are_a_value_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let _ = Vec::<(String, Option<f64>)>::decode(&mut Decoder::new(&bytes, SharedTable::default(), true));
            let _ = Diagnostics::decode(&mut Decoder::new(&bytes, SharedTable::default(), true));
        }
    }
}
