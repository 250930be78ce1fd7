//! Memory for large arrays.

use bytemuck::Zeroable;

/// So many zeros, which cost nothing until they are touched, in huge pages where [`prefer_huge_pages`] finds some.
pub(crate) fn zeroed<T: Zeroable>(length: usize) -> Vec<T> {
    let items = bytemuck::zeroed_vec(length);
    prefer_huge_pages(&items);
    items
}

/// Asks the system to back what a vector has room for by huge pages, as far as it has not been touched yet: touching a page of 4 KiB for
/// the first time takes as long as writing it several times over.
#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
pub(crate) fn prefer_huge_pages<T>(items: &Vec<T>) {
    /// As large as huge pages are on most machines, and a multiple of what other pages are.
    const HUGE: usize = 2 << 20;
    let first = items.as_ptr();
    let end = (first.addr() + items.capacity() * size_of::<T>()) & !(HUGE - 1);
    if let Some(start) = first.addr().checked_next_multiple_of(HUGE)
        && start < end
    {
        // SAFETY: the pages from `start` to `end` are all within what the vector has allocated. The advice says how they are to be
        // backed, never what they hold; a system that does not follow it leaves them as they are (madvise(2), MADV_HUGEPAGE).
        unsafe {
            libc::madvise(first.with_addr(start).cast_mut().cast(), end - start, libc::MADV_HUGEPAGE);
        }
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn prefer_huge_pages<T>(_: &Vec<T>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_any_length() {
        for length in [0, 1, 1000, (2 << 20) - 1, (4 << 20) + 3, 9 << 20] {
            let mut bytes: Vec<u8> = zeroed(length);
            assert!(bytes.len() == length && bytes.iter().all(|&byte| byte == 0));
            bytes.fill(7);
            bytes.push(8);
            assert!(bytes[..length].iter().all(|&byte| byte == 7));
        }
        assert_eq!(zeroed::<[f32; 3]>(1 << 20).len(), 1 << 20);
        for room in [0, 100, 3 << 20] {
            let mut items: Vec<u16> = Vec::with_capacity(room);
            prefer_huge_pages(&items);
            items.extend((0..room).map(|i| i as u16));
            assert!((0..room).all(|i| items[i] == i as u16));
        }
        // No memory of its own, however long.
        prefer_huge_pages(&vec![(); 1 << 40]);
    }
}
