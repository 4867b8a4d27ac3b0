//! Large pages for what rays read all over: the nodes and the triangles.
//!
//! A tree of 250,000 triangles lies on some 4000 pages of 4 KiB, more than a processor keeps the places of, and a walk
//! waits while they are looked up. On pages of 2 MiB they are a dozen.

/// Asks for large pages for the list's memory, before it is written to. Where the system has none, nothing happens.
pub(super) fn on_large_pages<T>(list: Vec<T>) -> Vec<T> {
    #[cfg(all(target_os = "linux", not(miri)))]
    {
        const PAGE: usize = 2 << 20;
        let start = list.as_ptr() as usize;
        let first = start.next_multiple_of(PAGE);
        let end = (start + list.capacity() * size_of::<T>()) / PAGE * PAGE;
        if first < end {
            // SAFETY: the range lies within the list's memory, and the advice changes neither content nor rights.
            // It may be refused, which is no matter.
            unsafe {
                libc::madvise(
                    list.as_ptr().cast_mut().byte_add(first - start).cast(),
                    end - first,
                    libc::MADV_HUGEPAGE,
                )
            };
        }
    }
    list
}
