//! Tells what a file is that is no component, so that its owner sees what went wrong.

use crate::LoadError;

const CORE_WAY_OUT: &str = "build the block with `cargo xtask guests`, or turn the module into a component with \
                            `wasm-tools component new`";

/// Refuses everything that does not begin as a component does.
pub(super) fn refuse(bytes: &[u8]) -> Result<(), LoadError> {
    let no =
        |found: &str, way_out: &str| Err(LoadError::NotAComponent { found: found.into(), way_out: way_out.into() });
    if bytes.is_empty() {
        return no("the file is empty", "build the block again and look for errors of the build");
    }
    if let Some(version) = bytes.strip_prefix(b"\0asm") {
        return match version {
            [0x0d, 0, 1, 0, ..] => Ok(()),
            [1, 0, 0, 0, ..] => no("this is a core module, not a component", CORE_WAY_OUT),
            [_, _, 1, 0, ..] => {
                no("this is a component in another version of the format", "build it again with current tools")
            }
            [_, _, _, _, ..] => no("this is WebAssembly of an unknown version", "build it again with current tools"),
            _ => no("the file ends within its first 8 bytes", "build or copy it again"),
        };
    }
    let start: Vec<u8> = bytes.iter().copied().skip_while(u8::is_ascii_whitespace).take(32).collect();
    if start.starts_with(b"(component") || start.starts_with(b"(module") || start.starts_with(b";;") {
        return no("this is WebAssembly in its text form", "turn it into the binary form with `wasm-tools parse`");
    }
    if start.starts_with(b"\x7fELF") {
        return no("this is a program or library for Linux", "build the block for wasm32-unknown-unknown");
    }
    let head = &bytes[..bytes.len().min(512)];
    let text = std::str::from_utf8(head).map_or_else(|e| e.error_len().is_none() && e.valid_up_to() > 0, |_| true);
    if text && !head.iter().any(|b| *b < 9) {
        return no("this is a text file", "name the `.wasm` file that the build made");
    }
    no("these are bytes of an unknown kind", "name the `.wasm` file that the build made")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_called_what_they_are() {
        for (bytes, found) in [
            (&b""[..], "the file is empty"),
            (b"\0asm\x01\0\0\0", "this is a core module, not a component"),
            (b"\0asm\x0c\0\x01\0", "this is a component in another version of the format"),
            (b"\0asm\x63\0\x07\0", "this is WebAssembly of an unknown version"),
            (b"\0asm\x0d", "the file ends within its first 8 bytes"),
            (b"\n (component)", "this is WebAssembly in its text form"),
            (b"[plant]\nname = \"x\"\n", "this is a text file"),
            (b"\x7fELF\x02\x01", "this is a program or library for Linux"),
            (b"\x93\x17\x00\xff", "these are bytes of an unknown kind"),
        ] {
            match refuse(bytes) {
                Err(LoadError::NotAComponent { found: f, .. }) => assert_eq!(f, found),
                other => panic!("{bytes:?}: {other:?}"),
            }
        }
        assert!(refuse(b"\0asm\x0d\0\x01\0").is_ok());
    }
}
