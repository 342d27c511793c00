//! The byte layout and the scheme in time, as numbers; `docs/reference/surrogate-format.md` describes both in words.

/// First eight bytes of a file; a transfer that rewrites line ends or strips bit 7 destroys them.
pub const MAGIC: [u8; 8] = *b"\x89CPLATE\n";
/// Version of the layout that this program writes.
pub const VERSION: u16 = 2;
/// Oldest version that this program reads; it has no further sections.
pub const OLDEST_VERSION: u16 = 1;
/// Largest number of condition variables (count). This bound and those below are chosen: they fix the memory of a
/// reader that cannot allocate.
pub const MAX_VARIABLES: usize = 8;
/// Largest number of measurement points (count).
pub const MAX_POINTS: usize = 256;
/// Largest number of terms of one polynomial block (count; the terms of every point in it together).
pub const MAX_TERMS: usize = 1024;
/// Largest total degree of a term (count).
pub const MAX_DEGREE: usize = 12;
/// Largest number of centres of one radial basis (count).
pub const MAX_CENTRES: usize = 4096;
/// Largest number of limits (count).
pub const MAX_LIMITS: usize = 256;
/// Largest number of provenance entries (count).
pub const MAX_PROVENANCE: usize = 256;
/// Largest number of held variables (count).
pub const MAX_HELD: usize = 64;
/// Largest number of uncertain parameters (count).
pub const MAX_PARAMETERS: usize = 32;
/// Largest number of terms of the slopes with respect to the parameters (count).
pub const MAX_SLOPE_TERMS: usize = 128;
/// Largest number of conditions at which a model was compared with measurements (count).
pub const MAX_MEASURED: usize = 256;
/// Largest number of further sections (count).
pub const MAX_SECTIONS: usize = 64;
/// Largest number of self-test vectors (count); there is at least one.
pub const MAX_SELF_TESTS: usize = 16;
/// Longest name or unit, in bytes.
pub const MAX_NAME: usize = 255;
/// Tolerance of a self-test (dimensionless): a value v must be reproduced to within this times max(1, |v|). Chosen:
/// above the rounding of other platforms, far below every accuracy in use.
pub const SELF_TEST_TOLERANCE: f64 = 1e-7;

/// Bytes of the header.
pub const HEADER: usize = 48;
/// Bytes of a variable, point or provenance record.
pub const SMALL_RECORD: usize = 8;
/// Bytes of a limit, centre-set, basis, held or parameter record.
pub const MEDIUM_RECORD: usize = 16;
/// Bytes of a polynomial record.
pub const POLYNOMIAL_RECORD: usize = 28;
/// Bytes of the tag and the length before the content of a further section.
pub const SECTION_HEADER: usize = 8;
/// Largest number of corners without a row (count): the four of every two variables.
pub const MAX_CORNERS: usize = 2 * MAX_VARIABLES * (MAX_VARIABLES - 1);
/// Bytes of the record of a corner without a row.
pub const CORNER_RECORD: usize = 16;
/// Tag of the section of corners of the fitted range that no row lies in.
pub const CORNERS: [u8; 4] = *b"CORN";
/// Tag of the section of readings that the states were learnt from; answers do not need it.
pub const READINGS: [u8; 4] = *b"read";
/// Tag of the section of held variables.
pub const HELD: [u8; 4] = *b"HELD";
/// Tag of the section on the uncertainty of the answers.
pub const UNCERTAIN: [u8; 4] = *b"UNCT";
/// Tag of the section on the dependence of answers on held variables; readers that do not need it skip it.
pub const FOLLOWED: [u8; 4] = *b"held";
/// Tag of the section on the error that the mesh leaves in each point; readers that need the band alone skip it.
pub const MESH: [u8; 4] = *b"mesh";
/// Tag of the section on the machine over time.
pub const IN_TIME: [u8; 4] = *b"time";
/// Bytes before the numbers of the section on the machine over time.
pub const IN_TIME_HEADER: usize = 32;
/// Largest number of states that a machine has over time (count).
pub const MAX_STATES: usize = 32;
/// Pole of the steps over time (dimensionless), common to all readers: the root of g³ - 3 g² + 3/2 g - 1/6 for which the
/// approximation of the exponential is L-stable (Nørsett 1974).
pub const POLE: f64 = 0.435_866_521_508_459;
/// Weights (dimensionless) of one, two and three solves in a step over time: they match the exponential to second order,
/// and with the pole to third.
pub const WEIGHTS: [f64; 3] = {
    let (first, second) = (1.0 / POLE, 0.5 / (POLE * POLE));
    let third = second - first - (first - 1.0);
    let two = first - 1.0 - 2.0 * third;
    [1.0 - two - third, two, third]
};
/// Bytes before the records of the section on the uncertainty of the answers.
pub const UNCERTAIN_HEADER: usize = 24;
/// Bytes of the checksum that ends the file.
pub const TRAILER: usize = 4;

/// CRC-32 (IEEE 802.3, reflected, as in zlib and PNG) of `bytes`.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    let (words, rest) = bytes.as_chunks::<4>();
    // Four bytes a step: the tables advance the register by one to four bytes each.
    for word in words {
        let [a, b, c, d] = (crc ^ u32::from_le_bytes(*word)).to_le_bytes();
        crc = TABLES[3][usize::from(a)] ^ TABLES[2][usize::from(b)] ^ TABLES[1][usize::from(c)] ^ TABLES[0][usize::from(d)];
    }
    for byte in rest {
        crc = (crc >> 8) ^ TABLES[0][usize::from(crc.to_le_bytes()[0] ^ byte)];
    }
    !crc
}

/// Tables of the checksum: the effect of a byte on the register after one to four bytes.
static TABLES: [[u32; 256]; 4] = tables();

const fn tables() -> [[u32; 256]; 4] {
    let mut tables = [[0u32; 256]; 4];
    let mut i = 0;
    while i < 256 {
        let mut crc = i as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            bit += 1;
        }
        tables[0][i] = crc;
        i += 1;
    }
    let mut bytes = 1;
    while bytes < 4 {
        let mut i = 0;
        while i < 256 {
            let previous = tables[bytes - 1][i];
            tables[bytes][i] = (previous >> 8) ^ tables[0][(previous & 0xff) as usize];
            i += 1;
        }
        bytes += 1;
    }
    tables
}

#[cfg(test)]
mod tests {
    use super::crc32;

    #[test]
    fn checksum_has_the_published_check_value() {
        // The check value of CRC-32/ISO-HDLC in the RevEng catalogue.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
    }
}
