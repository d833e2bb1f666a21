//! Sections of wasm modules and components: custom ones taken out and put in, others rewritten, all else byte for byte as it was.
//!
//! ```text
//! bytes ──► header │ section │ section │ … ──► the same without some, with some changed, with one more
//! ```
//!
//! Owns the walk over the sections of a file and the lengths in front of them. It must never know what a block or a class is,
//! nor of an engine: tools that build components use it, and they are built in seconds.
#![forbid(unsafe_code)]

use std::borrow::Cow;
use wasmparser::{BinaryReader, BinaryReaderError};

/// The custom section of a component that documents its classes: one JSON object, class → `{class, ports}`.
pub const DOCS: &str = "latchwork-docs";

const CUSTOM: u8 = 0;
const CORE_MODULE: u8 = 1;

/// Why the sections of a file cannot be read.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SectionError {
    /// It is shorter than any wasm file.
    #[error("it has {found} bytes; a wasm file begins with a header of 8")]
    Header {
        /// Its length, bytes.
        found: usize,
    },
    /// A section is cut off, or what is in it is.
    #[error("a section of it is broken: {0}")]
    Broken(#[from] BinaryReaderError),
}

/// The same file with each section as `change` wants it, which gets its number and its content: `None` leaves it out.
///
/// # Errors
/// The file has no header or a section is cut off, or `change` has failed.
pub fn rewrite<'a, E: From<SectionError>>(
    bytes: &'a [u8],
    mut change: impl FnMut(u8, &'a [u8]) -> Result<Option<Cow<'a, [u8]>>, E>,
) -> Result<Vec<u8>, E> {
    let (header, sections) = bytes.split_at_checked(8).ok_or(SectionError::Header { found: bytes.len() })?;
    let mut out = header.to_vec();
    let mut reader = BinaryReader::new(sections, 0);
    while !reader.eof() {
        let (id, body) = next(&mut reader)?;
        if let Some(body) = change(id, body)? {
            out.push(id);
            push_length(&mut out, body.len());
            out.extend_from_slice(&body);
        }
    }
    Ok(out)
}

fn next<'a>(reader: &mut BinaryReader<'a>) -> Result<(u8, &'a [u8]), SectionError> {
    let id = reader.read_u8()?;
    let size = reader.read_var_u32()? as usize;
    Ok((id, reader.read_bytes(size)?))
}

/// The same module or component without the named custom sections, in the modules inside a component, too.
///
/// # Errors
/// The file, or a module in it, has no header, or a section is cut off.
pub fn without(bytes: &[u8], names: &[&str]) -> Result<Vec<u8>, SectionError> {
    // Bytes 6 and 7 tell a component from a module, in which section 1 means something else.
    let component = bytes.get(6..8) == Some(&[1, 0]);
    rewrite(bytes, |id, body| match id {
        CUSTOM if is_named(body, names)? => Ok(None),
        CORE_MODULE if component => Ok(Some(module_without(body, names)?.into())),
        _ => Ok(Some(body.into())),
    })
}

/// Not the same function again: no file can make it call itself.
fn module_without(bytes: &[u8], names: &[&str]) -> Result<Vec<u8>, SectionError> {
    rewrite(bytes, |id, body| Ok((id != CUSTOM || !is_named(body, names)?).then_some(body.into())))
}

fn is_named(section: &[u8], names: &[&str]) -> Result<bool, SectionError> {
    Ok(names.contains(&BinaryReader::new(section, 0).read_string()?))
}

/// Puts a custom section at the end of a module or component.
pub fn append(file: &mut Vec<u8>, name: &str, data: &[u8]) {
    // No length has more than 5 bytes.
    let mut body = Vec::with_capacity(5 + name.len() + data.len());
    push_length(&mut body, name.len());
    body.extend_from_slice(name.as_bytes());
    body.extend_from_slice(data);
    file.push(CUSTOM);
    push_length(file, body.len());
    file.extend_from_slice(&body);
}

/// Appends a number as all lengths in wasm are: LEB128.
pub fn push_length(out: &mut Vec<u8>, mut length: usize) {
    while length > 0x7f {
        out.push((length & 0x7f) as u8 | 0x80);
        length >>= 7;
    }
    out.push(length as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULE: &[u8] = b"\0asm\x01\0\0\0";
    const COMPONENT: &[u8] = b"\0asm\x0d\0\x01\0";

    fn section(file: &mut Vec<u8>, id: u8, body: &[u8]) {
        file.push(id);
        push_length(file, body.len());
        file.extend_from_slice(body);
    }

    #[test]
    fn named_sections_vanish_also_inside_a_component_and_all_else_stays() {
        let mut inner = MODULE.to_vec();
        append(&mut inner, "keep", &[7; 300]);
        let kept = inner.clone();
        append(&mut inner, "name", &[1, 2, 3]);
        let wrap = |module: &[u8]| {
            let mut out = COMPONENT.to_vec();
            section(&mut out, CORE_MODULE, module);
            out
        };
        assert_eq!(without(&wrap(&inner), &["name"]).unwrap(), wrap(&kept));
        assert_eq!(without(&inner, &["name"]).unwrap(), kept);
        assert_eq!(without(&wrap(&inner), &[]).unwrap(), wrap(&inner));
    }

    #[test]
    fn types_of_a_module_are_not_taken_for_a_module_inside_it() {
        let mut module = MODULE.to_vec();
        // One type: a function without parameters and results.
        section(&mut module, 1, &[1, 0x60, 0, 0]);
        assert_eq!(without(&module, &["name"]).unwrap(), module);
    }

    #[test]
    fn an_appended_section_is_read_as_one_by_a_parser() {
        for length in [0, 1, 100, 126, 127, 128, 20_000] {
            let mut module = MODULE.to_vec();
            append(&mut module, DOCS, &vec![b'x'; length]);
            let mut found = Vec::new();
            for payload in wasmparser::Parser::new(0).parse_all(&module) {
                if let wasmparser::Payload::CustomSection(section) = payload.unwrap() {
                    found.push((section.name().to_owned(), section.data().len()));
                }
            }
            assert_eq!(found, [(DOCS.to_owned(), length)]);
        }
    }

    #[test]
    fn a_section_is_changed_and_what_fails_is_told() {
        let mut module = MODULE.to_vec();
        section(&mut module, 7, &[0]);
        let mut longer = MODULE.to_vec();
        section(&mut longer, 7, &[9; 200]);
        let changed = rewrite(&module, |_, _| Ok::<_, SectionError>(Some(vec![9; 200].into())));
        assert_eq!(changed.unwrap(), longer);
        let failed = rewrite(&module, |_, body| Err(SectionError::Header { found: body.len() }));
        assert!(matches!(failed, Err(SectionError::Header { found: 1 })));
    }

    #[test]
    fn what_is_cut_off_anywhere_but_between_sections_is_an_error() {
        let mut inner = MODULE.to_vec();
        append(&mut inner, "name", &[1, 2, 3]);
        let mut whole = COMPONENT.to_vec();
        section(&mut whole, CORE_MODULE, &inner);
        let end = whole.len();
        append(&mut whole, "name", &[4; 200]);
        for cut in 0..whole.len() {
            let read = without(&whole[..cut], &["name"]);
            assert_eq!(read.is_ok(), cut == COMPONENT.len() || cut == end, "{cut}: {read:?}");
        }
        assert_eq!(
            without(b"\0asm", &[]).unwrap_err().to_string(),
            "it has 4 bytes; a wasm file begins with a header of 8"
        );
    }
}
