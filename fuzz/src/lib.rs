//! What the fuzz targets share: damage that a checksum of 32 bits must notice.

/// `sound` with one burst of at most four bytes overwritten and, at times, its end cut off.
///
/// The first bytes of `plan` say where, the rest what with. A CRC-32 notices every burst of up to 32 bits, so a
/// reader has no excuse for taking the result for sound unless it is `sound` itself.
pub fn damaged(sound: &[u8], plan: &[u8]) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    let [a, b, c, d, cut, burst @ ..] = plan else { return bytes };
    let at = u32::from_le_bytes([*a, *b, *c, *d]) as usize % sound.len();
    if *cut == u8::MAX {
        bytes.truncate(at);
        return bytes;
    }
    for (byte, value) in bytes[at..].iter_mut().zip(burst.iter().take(4)) {
        *byte = *value;
    }
    bytes
}
