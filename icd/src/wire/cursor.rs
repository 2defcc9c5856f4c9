//! Little-endian fields in and out of a byte slice.

use super::{PacketBytes, WireError};

/// Appends fields to a packet; the packet types are smaller than the buffer, which a test checks.
pub(super) struct Writer<'a>(pub &'a mut PacketBytes);

impl Writer<'_> {
    #[inline]
    pub fn bytes(&mut self, bytes: &[u8]) {
        // Cannot fail: the largest packet fits, see `the_largest_packets_fit`.
        let _fits = self.0.try_extend_from_slice(bytes);
        debug_assert!(_fits.is_ok());
    }
    #[inline]
    pub fn u8(&mut self, v: u8) {
        self.bytes(&[v]);
    }
    #[inline]
    pub fn u16(&mut self, v: u16) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn u32(&mut self, v: u32) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn u64(&mut self, v: u64) {
        self.bytes(&v.to_le_bytes());
    }
    #[inline]
    pub fn f64(&mut self, v: f64) {
        self.bytes(&v.to_le_bytes());
    }
    /// Closes the packet with its checksum.
    #[inline]
    pub fn finish(self) {
        let crc = crc32fast::hash(self.0);
        let _fits = self.0.try_extend_from_slice(&crc.to_le_bytes());
    }
}

/// Takes fields from the front of a slice.
pub(super) struct Reader<'a> {
    pub left: &'a [u8],
    pub total: usize,
}

impl Reader<'_> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let (head, tail) =
            self.left.split_first_chunk::<N>().ok_or(WireError::Length { bytes: self.total })?;
        self.left = tail;
        Ok(*head)
    }
    #[inline]
    pub fn u8(&mut self) -> Result<u8, WireError> {
        self.take::<1>().map(|[b]| b)
    }
    #[inline]
    pub fn u16(&mut self) -> Result<u16, WireError> {
        self.take().map(u16::from_le_bytes)
    }
    #[inline]
    pub fn u32(&mut self) -> Result<u32, WireError> {
        self.take().map(u32::from_le_bytes)
    }
    #[inline]
    pub fn u64(&mut self) -> Result<u64, WireError> {
        self.take().map(u64::from_le_bytes)
    }
    #[inline]
    pub fn f64(&mut self) -> Result<f64, WireError> {
        self.take().map(f64::from_le_bytes)
    }
    /// So many bytes.
    #[inline]
    pub fn bytes(&mut self, count: usize) -> Result<&[u8], WireError> {
        let error = WireError::Length { bytes: self.total };
        let (head, tail) = self.left.split_at_checked(count).ok_or(error)?;
        self.left = tail;
        Ok(head)
    }
    /// Several values with one look at the length.
    #[inline]
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], WireError> {
        let error = WireError::Length { bytes: self.total };
        let (head, tail) = self.left.split_at_checked(8 * N).ok_or(error)?;
        self.left = tail;
        let (chunks, _) = head.as_chunks::<8>();
        let mut values = [0.0; N];
        for (value, chunk) in values.iter_mut().zip(chunks) {
            *value = f64::from_le_bytes(*chunk);
        }
        Ok(values)
    }
}
