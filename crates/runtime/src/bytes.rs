//! Little-endian numbers in byte slices. Nothing here can panic: missing bytes read as zero, and opening a file makes
//! sure that no bytes are missing.

/// A run of f64 in the file, read where it lies.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers<'a>(pub(crate) &'a [[u8; 8]]);

impl<'a> Numbers<'a> {
    /// Number of numbers.
    #[must_use]
    pub fn len(self) -> usize {
        self.0.len()
    }

    /// True if there are none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    /// Number `index`, if there is one.
    #[inline(always)]
    #[must_use]
    pub fn get(self, index: usize) -> Option<f64> {
        self.0.get(index).map(|b| f64::from_le_bytes(*b))
    }

    /// All of them in order.
    #[inline(always)]
    pub fn iter(self) -> impl ExactSizeIterator<Item = f64> + 'a {
        self.0.iter().map(|b| f64::from_le_bytes(*b))
    }

    /// Number `index`, which opening has checked to exist.
    #[inline(always)]
    pub(crate) fn at(self, index: usize) -> f64 {
        self.get(index).unwrap_or(0.0)
    }

    /// Runs of `count` numbers; none of no numbers.
    pub(crate) fn chunks(self, count: usize) -> impl Iterator<Item = Self> {
        self.0.chunks_exact(count.max(1)).map(Self)
    }

    /// `count` numbers from `start`; none if they are not all there.
    pub(crate) fn part(self, start: usize, count: usize) -> Self {
        Self(start.checked_add(count).and_then(|end| self.0.get(start..end)).unwrap_or(&[]))
    }
}

/// The u16 at byte `at`.
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> usize {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |b| usize::from(u16::from_le_bytes(*b)))
}

/// The u32 at byte `at`. No file is longer than 4 GiB: the value fits wherever the file does.
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> usize {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |b| u32::from_le_bytes(*b) as usize)
}

/// `count` items from `start`; none if they are not all there.
pub(crate) fn part<T>(items: &[T], start: usize, count: usize) -> &[T] {
    start.checked_add(count).and_then(|end| items.get(start..end)).unwrap_or(&[])
}
