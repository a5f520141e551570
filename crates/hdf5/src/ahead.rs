//! Reading ahead.
//!
//! Some frames of a data set [vertices, 3, frames] that is not in chunks are many small pieces at even distances:
//! read one by one, each costs a call of the system. Where reads follow one another closely, a longer piece
//! of the file is read at once, and the next ones are taken out of it.

use std::sync::{Mutex, PoisonError};

use hdf5_reader::error::Result;
use hdf5_reader::storage::{DynStorage, Storage, StorageBuffer};
use std::sync::Arc;

/// Bytes that are read at once where reads follow one another.
const PIECE_BYTES: usize = 256 << 10;
/// Bytes between two reads up to which what lies between is read too: a page of the disk's cache, which would be
/// fetched in any case.
const CLOSE_BYTES: u64 = 4096;

/// Storage that reads ahead.
pub(crate) struct Ahead {
    inner: DynStorage,
    last: Mutex<Last>,
}

/// What was read last.
#[derive(Default)]
struct Last {
    /// Where the last read that was asked for ended.
    asked_end: u64,
    /// The last piece that was read ahead, and where it begins.
    start: u64,
    bytes: Arc<[u8]>,
}

impl Last {
    /// The range, where the piece holds it.
    fn part(&self, offset: u64, len: usize) -> Option<Result<StorageBuffer>> {
        let from = usize::try_from(offset.checked_sub(self.start)?).ok()?;
        let is_inside = from.checked_add(len)? <= self.bytes.len();
        is_inside.then(|| StorageBuffer::from_shared(Arc::clone(&self.bytes), from, len))
    }
}

impl Ahead {
    pub fn new(inner: DynStorage) -> Self {
        Self {
            inner,
            last: Mutex::default(),
        }
    }
}

impl Storage for Ahead {
    fn len(&self) -> u64 {
        self.inner.len()
    }

    fn read_range(&self, offset: u64, len: usize) -> Result<StorageBuffer> {
        if len >= PIECE_BYTES {
            return self.inner.read_range(offset, len);
        }
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let follows = offset
            .checked_sub(last.asked_end)
            .is_some_and(|between| between <= CLOSE_BYTES);
        last.asked_end = offset.saturating_add(len as u64);
        if let Some(part) = last.part(offset, len) {
            return part;
        }
        let left = usize::try_from(self.len().saturating_sub(offset)).unwrap_or(usize::MAX);
        let piece = PIECE_BYTES.min(left);
        if !follows || piece <= len {
            return self.inner.read_range(offset, len);
        }
        let read = self.inner.read_range(offset, piece)?;
        (last.start, last.bytes) = (offset, Arc::from(&*read));
        StorageBuffer::from_shared(Arc::clone(&last.bytes), 0, len)
    }
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    reason = "a failed step of a test is a failed test"
)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use hdf5_reader::storage::BytesStorage;

    use super::*;

    /// Counts what is read.
    struct Counted {
        inner: BytesStorage,
        reads: AtomicUsize,
    }

    impl Storage for Counted {
        fn len(&self) -> u64 {
            self.inner.len()
        }

        fn read_range(&self, offset: u64, len: usize) -> Result<StorageBuffer> {
            self.reads.fetch_add(1, Ordering::Relaxed);
            self.inner.read_range(offset, len)
        }
    }

    #[test]
    fn reads_that_follow_one_another_are_few_and_all_are_right() {
        let bytes: Vec<u8> = (0..3_000_000_u32).map(|i| (i / 7) as u8).collect();
        let counted = Arc::new(Counted {
            inner: BytesStorage::new(bytes.clone()),
            reads: AtomicUsize::new(0),
        });
        let ahead = Ahead::new(Arc::clone(&counted) as DynStorage);
        let check = |offset: usize, len: usize| {
            let read = ahead.read_range(offset as u64, len).unwrap();
            assert_eq!(&read[..], &bytes[offset..offset + len], "{offset}, {len}");
        };
        for row in 0..1_400 {
            check(row * 2_036, 4);
        }
        let reads = counted.reads.swap(0, Ordering::Relaxed);
        assert!(reads < 20, "{reads} reads");
        // Far apart, backwards, as a whole, and at the end.
        for offset in [0, 2_000_000, 1_000_000, 5_000, 0, 2_999_996] {
            check(offset, 4);
        }
        check(0, bytes.len());
        check(2_999_990, 10);
        assert!(ahead.read_range(2_999_996, 8).is_err());
        assert!(ahead.read_range(u64::MAX - 2, 8).is_err());
    }

    #[test]
    fn reads_far_apart_read_no_more_than_they_ask_for() {
        struct Exact(BytesStorage);
        impl Storage for Exact {
            fn len(&self) -> u64 {
                self.0.len()
            }
            fn read_range(&self, offset: u64, len: usize) -> Result<StorageBuffer> {
                assert_eq!(len, 4);
                self.0.read_range(offset, len)
            }
        }
        let ahead = Ahead::new(Arc::new(Exact(BytesStorage::new(vec![0; 1 << 20]))));
        for row in 1..50 {
            ahead.read_range(row * 20_000, 4).unwrap();
        }
    }
}
