//! From a list of variables and codes to the rules of the plant file.

use latchwork_alarm::{Code, CodeKind};
use latchwork_image::Type;
use latchwork_plant::model::{Model, TagRef};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

/// The rules for a list, as text for the plant file.
///
/// # Errors
/// Every line with a code that is none of the nine or does not fit its variable, with an unknown variable, or with one that was
/// named before.
pub(super) fn rules(model: &Model, list: &str, file: &str) -> Result<String, Vec<String>> {
    let list = list.trim_start_matches('\u{feff}');
    // Spreadsheets of some countries write semicolons.
    let header = list.lines().next().unwrap_or_default();
    let delimiter = if header.contains(';') && !header.contains(',') { b';' } else { b',' };
    let mut csv = csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(list.as_bytes());
    let columns = columns(&mut csv, file).map_err(|error| vec![error])?;
    let bools = bools(model);
    let (mut out, mut errors) = (format!("# Codes of {file}\n"), Vec::new());
    let mut seen: HashMap<String, u64> = HashMap::new();
    for row in csv.records() {
        let row = match row {
            Ok(row) => row,
            Err(error) => {
                errors.push(format!("{file}: {error}"));
                continue;
            }
        };
        let line = row.position().map_or(0, |p| p.line());
        let [name, code] = columns.map(|n| row.get(n).unwrap_or_default());
        if name.is_empty() && code.is_empty() {
            continue;
        }
        if let Some(before) = seen.insert(name.into(), line) {
            errors.push(format!("{file}:{line}: `{name}` stands in line {before} already; a variable has one code"));
            continue;
        }
        // Without a code it shall have none.
        if code.is_empty() {
            continue;
        }
        match fits(&bools, name, code) {
            Ok(kind) => {
                // Writing to a String never fails.
                let pattern = regex::escape(name);
                let _ = write!(
                    out,
                    "\n[[alarm]]\nmatch = '{pattern}'\ncode = {:#06X}    # {}\n",
                    kind.bits(),
                    kind.words()
                );
            }
            Err(error) => errors.push(format!("{file}:{line}: {error}")),
        }
    }
    if errors.is_empty() { Ok(out) } else { Err(errors) }
}

/// Numbers of the columns with the name and the code.
fn columns(csv: &mut csv::Reader<&[u8]>, file: &str) -> Result<[usize; 2], String> {
    let header = csv.headers().map_err(|error| format!("{file}: {error}"))?;
    let find = |column: &str| {
        header.iter().position(|h| h.eq_ignore_ascii_case(column)).ok_or_else(|| {
            let expected = super::list::COLUMNS.join(",");
            format!(
                "{file}:1: there is no column `{column}`; expected the header `{expected}`, as --format csv writes it"
            )
        })
    };
    Ok([find("tag name")?, find("code")?])
}

/// All bools that can have a code, by name.
fn bools(model: &Model) -> BTreeMap<String, TagRef> {
    let points = model
        .drivers
        .iter()
        .enumerate()
        .flat_map(|(driver, d)| (0..d.config.points.len()).map(move |point| TagRef::Point { driver, point }));
    let ports = model.blocks.iter().enumerate().flat_map(|(block, b)| {
        let inputs = (0..b.class.inputs.len()).map(move |port| TagRef::Input { block, port });
        inputs.chain((0..b.class.outputs.len()).map(move |port| TagRef::Output { block, port }))
    });
    let others = points.chain(ports).filter(|tag| model.tag_type(*tag) == Type::Bool);
    let known = model.variables.iter().map(|v| (v.name.clone(), v.tag));
    others.map(|tag| (model.tag_name(tag), tag)).chain(known).collect()
}

/// The kind that a code gives a variable.
fn fits(bools: &BTreeMap<String, TagRef>, name: &str, code: &str) -> Result<CodeKind, String> {
    let hex = code.strip_prefix("0x").or_else(|| code.strip_prefix("0X"));
    let bits = hex.map_or_else(|| code.parse().ok(), |digits| u16::from_str_radix(digits, 16).ok());
    let bits =
        bits.ok_or_else(|| format!("`{name}` has the code `{code}`; expected a number as in 51200 or 0xC800"))?;
    let kind = Code::new(bits, name).map_err(|error| error.to_string())?.kind();
    let Some(tag) = bools.get(name) else {
        return Err(format!(
            "there is no alarm, command or other bool `{name}` in the plant; see `latchwork tags PLANT`"
        ));
    };
    match (tag, kind.is_alarm()) {
        (TagRef::Command { .. }, true) => Err(format!("`{name}` is a command; {bits:#06X} is for alarms")),
        (TagRef::Command { .. }, false) | (_, true) => Ok(kind),
        (_, false) => Err(format!("`{name}` is no command; {bits:#06X} is for commands")),
    }
}
