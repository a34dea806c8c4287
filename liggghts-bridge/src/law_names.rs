//! Names of laws for C++, which registers one style per law.

#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::c_char;

use concordem_contact::law::LawName;

/// Write the name of law `index` to `name` (`capacity` bytes, zero-terminated); `bonds` selects the bond laws (1) or the contact laws
/// (0). Returns the length of the name, or −1 if there is no such law or the name does not fit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_law_name(bonds: i32, index: i32, name: *mut c_char, capacity: usize) -> i32 {
    let law = usize::try_from(index)
        .ok()
        .and_then(|index| if bonds == 0 { LawName::contacts().nth(index) } else { LawName::bonds().nth(index) });
    let Some(key) = law.map(LawName::key).filter(|key| key.len() < capacity) else { return -1 };
    // SAFETY: the caller gives `capacity` bytes.
    unsafe {
        std::ptr::copy_nonoverlapping(key.as_ptr(), name.cast(), key.len());
        *name.add(key.len()) = 0;
    }
    key.len() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_laws() {
        let mut text = [1; 32];
        // SAFETY: a buffer of its length.
        let length = unsafe { concordem_law_name(1, 0, text.as_mut_ptr(), text.len()) };
        let read: Vec<u8> = text[..length as usize].iter().map(|&byte| byte as u8).collect();
        assert_eq!(read, LawName::bonds().next().expect("there is one").key().as_bytes());
        assert_eq!(text[length as usize], 0);
        // SAFETY: as above.
        let past = unsafe { concordem_law_name(0, LawName::contacts().count() as i32, text.as_mut_ptr(), text.len()) };
        assert_eq!(past, -1);
    }
}
