//! Shared by the C interfaces of both bridges: error messages for C++, slices of the host's arrays, and (feature `header`) the test
//! that keeps the committed C header equal to the Rust declarations.

mod guard;
#[cfg(feature = "header")]
pub mod header;
mod slices;

pub use guard::{Message, guarded};
pub use slices::{Count, length_of, slice, slice_mut};

/// FNV-1a hash of a C header, without the last line, which defines the hash itself.
///
/// The shim compares the hash of the header it was compiled with to the one that the library returns. Any difference in a field,
/// type, or signature changes it.
pub const fn header_hash(header: &[u8]) -> u64 {
    const MARK: &[u8] = b"#define CONCORDEM_HEADER_HASH";
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut at = 0;
    while at < header.len() {
        let mut same = 0;
        while same < MARK.len() && at + same < header.len() && header[at + same] == MARK[same] {
            same += 1;
        }
        if same == MARK.len() {
            break;
        }
        hash = (hash ^ header[at] as u64).wrapping_mul(0x0100_0000_01b3);
        at += 1;
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::header_hash;

    #[test]
    fn the_hash_ends_before_its_own_line() {
        let text = "struct A;\n";
        let whole = format!("{text}#define CONCORDEM_HEADER_HASH 1\n");
        assert_eq!(header_hash(text.as_bytes()), header_hash(whole.as_bytes()));
        assert_ne!(header_hash(b"struct A;\n"), header_hash(b"struct B;\n"));
        // Reference value of FNV-1a.
        assert_eq!(header_hash(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
