//! Values as bytes: little-endian, without padding, nothing but the fields.

use std::num::NonZeroU32;

/// A value that can travel as bytes. Floats keep their bits.
pub trait Wire: Sized {
    /// Appends the value.
    fn encode(&self, bytes: &mut Vec<u8>);

    /// Reads a value and moves `bytes` behind it.
    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError>;
}

/// Bytes that are not what they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The bytes end too early.
    #[error("ends within a value")]
    Short,
    /// Bytes are left over.
    #[error("has {0} bytes too many")]
    Long(usize),
    /// A number that cannot be 0 is.
    #[error("has a 0 where none can be")]
    Zero,
    /// A byte that should tell variants apart tells none.
    #[error("has no variant {0}")]
    Variant(u8),
    /// What was packed does not unpack.
    #[error("cannot be unpacked")]
    Packed,
}

macro_rules! wire_numbers {
    ($($number:ty)*) => { $(
        impl Wire for $number {
            fn encode(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }

            fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
                let (head, tail) = bytes.split_first_chunk().ok_or(WireError::Short)?;
                *bytes = tail;
                Ok(Self::from_le_bytes(*head))
            }
        }
    )* };
}

wire_numbers!(u8 u16 u32 u64 i32 i64 f32 f64);

impl Wire for NonZeroU32 {
    fn encode(&self, bytes: &mut Vec<u8>) {
        self.get().encode(bytes);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Self::new(u32::decode(bytes)?).ok_or(WireError::Zero)
    }
}

impl Wire for bool {
    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(*self));
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        match u8::decode(bytes)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(WireError::Variant(other)),
        }
    }
}

impl<T: Wire> Wire for Option<T> {
    fn encode(&self, bytes: &mut Vec<u8>) {
        self.is_some().encode(bytes);
        if let Some(value) = self {
            value.encode(bytes);
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        bool::decode(bytes)?.then(|| T::decode(bytes)).transpose()
    }
}

/// Count, then the bytes themselves.
impl Wire for Box<[u8]> {
    fn encode(&self, bytes: &mut Vec<u8>) {
        (self.len() as u32).encode(bytes);
        bytes.extend_from_slice(self);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        let n = u32::decode(bytes)? as usize;
        let (head, tail) = bytes.split_at_checked(n).ok_or(WireError::Short)?;
        *bytes = tail;
        Ok(head.into())
    }
}

impl<const N: usize> Wire for [f32; N] {
    fn encode(&self, bytes: &mut Vec<u8>) {
        for value in self {
            value.encode(bytes);
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f32::decode(bytes)?;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<T: Wire + PartialEq + std::fmt::Debug>(value: &T) {
        let mut bytes = Vec::new();
        value.encode(&mut bytes);
        let mut rest = bytes.as_slice();
        assert_eq!(T::decode(&mut rest).as_ref(), Ok(value));
        assert!(rest.is_empty());
        for end in 0..bytes.len() {
            assert_eq!(T::decode(&mut &bytes[..end]), Err(WireError::Short));
        }
    }

    #[test]
    fn values_survive_and_short_ones_are_refused() {
        check(&0x1234_5678_u32);
        check(&-1_i64);
        check(&Some([1.0_f32, -0.0, f32::MIN_POSITIVE]));
        check(&None::<u8>);
        check(&true);
        check(&NonZeroU32::MIN);
        check(&Box::<[u8]>::from([7, 0, 9]));
    }

    #[test]
    fn unknown_variants_are_refused() {
        assert_eq!(bool::decode(&mut &[2][..]), Err(WireError::Variant(2)));
        assert_eq!(
            Option::<u8>::decode(&mut &[7, 0][..]),
            Err(WireError::Variant(7))
        );
        assert_eq!(NonZeroU32::decode(&mut &[0; 4][..]), Err(WireError::Zero));
    }
}
