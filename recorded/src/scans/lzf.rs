//! The compression LZF of `binary_compressed` PCD files.
//!
//! The format is from liblzf by Marc Lehmann. A control byte `c` below 32 introduces `c` + 1 bytes
//! that are taken as they are. Any other control byte introduces a copy of earlier output:
//!
//! - The upper three bits of the control byte are the length of the copy minus 2. If they are 7,
//!   the next byte is added to the length.
//! - The lower five bits and the following byte are the distance back to the copied bytes minus 1.

/// Control bytes below this one introduce bytes as they are.
const LITERAL: u8 = 32;
/// Value of the upper bits of a control byte at which the next byte is added to the length.
const LONG: usize = 7;

/// Longest data for which memory is reserved before a byte is read (bytes): a damaged file may
/// state any size.
const MOST_RESERVED_BYTES: usize = 1 << 28;

/// Decompresses data to exactly `size` bytes.
///
/// # Errors
/// What is wrong with the compressed points, which the message calls "they".
pub(super) fn decompress(compressed: &[u8], size: usize) -> Result<Vec<u8>, &'static str> {
    const CUT: &str = "they end too early";
    let mut data: Vec<u8> = Vec::with_capacity(size.min(MOST_RESERVED_BYTES));
    let mut bytes = compressed;
    while let Some((&control, rest)) = bytes.split_first() {
        bytes = rest;
        if control < LITERAL {
            let (literal, rest) = bytes.split_at_checked(usize::from(control) + 1).ok_or(CUT)?;
            data.extend_from_slice(literal);
            bytes = rest;
        } else {
            let mut length = usize::from(control >> 5);
            if length == LONG {
                let (&more, rest) = bytes.split_first().ok_or(CUT)?;
                length += usize::from(more);
                bytes = rest;
            }
            let (&low, rest) = bytes.split_first().ok_or(CUT)?;
            bytes = rest;
            let distance = (usize::from(control & 31) << 8) + usize::from(low) + 1;
            let start = data.len().checked_sub(distance).ok_or("a copy begins before the data")?;
            // The copied bytes may include bytes that this copy has just written.
            (start..start + length + 2).for_each(|index| data.push(data[index]));
        }
        if data.len() > size {
            return Err("they are longer than stated");
        }
    }
    if data.len() == size { Ok(data) } else { Err("they are shorter than stated") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_overlapping_copies_are_decompressed() {
        // `abc`, then nine bytes copied from a distance of three, then a long copy.
        let compressed = [2, b'a', b'b', b'c', (7 << 5), 0, 2, (7 << 5), 3, 0];
        let data = decompress(&compressed, 24).unwrap();
        assert_eq!(data, [b"abcabcabcabc".as_slice(), &[b'c'; 12]].concat());
        assert_eq!(decompress(&compressed, 25), Err("they are shorter than stated"));
        assert_eq!(decompress(&compressed, 20), Err("they are longer than stated"));
        assert_eq!(decompress(&[4, b'a'], 5), Err("they end too early"));
        assert_eq!(decompress(&[0, b'a', 32, 9], 5), Err("a copy begins before the data"));
    }
}
