//! The arrays of a legacy file. One that is not whole is left out, with what is wrong with it.

use super::Parts;
use super::scan::{Scanner, Type};
use crate::mesh::{Array, LeftOut, Role, Values};

/// The keywords of sections that hold one array of points or cells, and what it is for.
const ATTRIBUTES: [(&str, Option<Role>); 12] = [
    ("SCALARS", Some(Role::Scalars)),
    ("COLOR_SCALARS", Some(Role::Scalars)),
    ("VECTORS", Some(Role::Vectors)),
    ("NORMALS", Some(Role::Normals)),
    ("TANGENTS", Some(Role::Tangents)),
    ("TENSORS", Some(Role::Tensors)),
    ("TENSORS6", Some(Role::Tensors)),
    ("TEXTURE_COORDINATES", Some(Role::TextureCoordinates)),
    ("GLOBAL_IDS", Some(Role::GlobalIds)),
    ("PEDIGREE_IDS", Some(Role::PedigreeIds)),
    ("EDGE_FLAGS", Some(Role::EdgeFlags)),
    ("LOOKUP_TABLE", None),
];

/// What an array's own lines say of it.
struct Described {
    name: String,
    components: usize,
    tuples: usize,
    kind: Type,
}

impl Parts {
    /// Reads a section of data that starts at byte `at`, as far as it is whole. Goes to where the next one starts.
    pub(super) fn data(&mut self, from: &mut Scanner<'_>, keyword: &str, at: usize) {
        let start = from.at();
        if keyword == "FIELD" {
            self.fields(from);
        } else if keyword == "METADATA" {
            from.pass_description();
        } else if let Some((_, role)) = ATTRIBUTES.iter().find(|(known, _)| *known == keyword) {
            let mut name = String::new();
            let result = self.attribute(from, keyword, &mut name);
            let result = result.and_then(|array| from.check_end(start, false).map(|()| array));
            match result {
                Ok(array) => self.keep(array, *role),
                Err(what) => {
                    self.leave_out(&name, keyword, at, what);
                    from.go_on(start, false);
                }
            }
        } else {
            let known = keyword.len() < 40 && keyword.chars().all(|c| c.is_ascii_graphic());
            let keyword = if known { keyword } else { "something" };
            // Arrays after such a line would be of what it names.
            if keyword.ends_with("_DATA") {
                self.current = None;
            }
            from.go_on(start, false);
            let to = from.at();
            self.notes
                .push(format!("a section that is not known, {keyword}, at byte {at}, is left out, up to byte {to}"));
        }
    }

    /// The arrays of a field: of points or cells; before any section of such, of the file, and passed over.
    fn fields(&mut self, from: &mut Scanner<'_>) {
        let count = from.word("its name").and_then(|_| from.count("its number of arrays")).unwrap_or(0);
        for i in 0..count {
            let at = from.at_word();
            if from.is_at_end() || from.is_at_section() && !from.is_at_field() {
                self.notes.push(format!("a FIELD of {count} arrays has {i}, up to byte {at}"));
                return;
            }
            let mut name = String::new();
            let mut start = from.at();
            let result = described(from, &mut name).and_then(|described| match described {
                Some(described) => {
                    start = from.at();
                    let array = self.field(from, described, at)?;
                    from.pass_metadata();
                    from.check_end(start, true)?;
                    Ok(Some(array))
                }
                None => Ok(None),
            });
            match result {
                Ok(Some(array)) => self.keep(array, None),
                Ok(None) => {}
                Err(what) => {
                    if self.current.is_some() {
                        self.leave_out(&name, "FIELD", at, what);
                    }
                    from.go_on(start, true);
                }
            }
        }
    }

    /// The numbers of an array of a field, at byte `at`; none if they are not kept.
    fn field(&mut self, from: &mut Scanner<'_>, array: Described, at: usize) -> Result<Option<Array>, String> {
        let Described { name, components, tuples, kind } = array;
        let values = from.values(kind, components.checked_mul(tuples))?;
        let Some((_, needed)) = self.current else { return Ok(None) };
        match values {
            Some(values) if tuples == needed && components > 0 => {
                return Ok(Some(Array { name: decoded(&name), components, values }));
            }
            Some(_) => {
                let what = format!("it has {tuples} tuples of {components} numbers where {needed} are needed");
                self.leave_out(&name, "FIELD", at, what);
            }
            None => self.leave_out(&name, "FIELD", at, "its type is string".to_owned()),
        }
        Ok(None)
    }

    /// An array of points or cells that says by its keyword what it is for; none if it is not kept.
    fn attribute(&mut self, from: &mut Scanner<'_>, keyword: &str, name: &mut String) -> Result<Option<Array>, String> {
        let at = from.at();
        *name = from.word("its name")?;
        let colors = Type::from_name(if from.binary { "unsigned_char" } else { "float" }, from.binary)?;
        if keyword == "LOOKUP_TABLE" {
            let size = from.count("its size")?;
            from.values(colors, size.checked_mul(4))?;
            return Ok(None);
        }
        let Some((_, tuples)) = self.current else { return Err("it comes before POINT_DATA or CELL_DATA".to_owned()) };
        let typed = |from: &mut Scanner<'_>| Type::from_name(&from.word("its type")?, from.binary);
        let (components, kind) = match keyword {
            "COLOR_SCALARS" => (from.count("its number of components")?, colors),
            "TEXTURE_COORDINATES" => (from.count("its number of components")?, typed(from)?),
            "SCALARS" => {
                let kind = typed(from)?;
                // On the same line, or there is one; a table of colours may be named on the next.
                let components = from.count_on_line().unwrap_or(1);
                from.pass_table()?;
                (components, kind)
            }
            "VECTORS" | "NORMALS" | "TANGENTS" => (3, typed(from)?),
            "TENSORS6" => (6, typed(from)?),
            "TENSORS" => (9, typed(from)?),
            _ => (1, typed(from)?),
        };
        if components == 0 {
            return Err("it has no components".to_owned());
        }
        let values = match (keyword, from.values(kind, components.checked_mul(tuples))?) {
            (_, None) => {
                self.leave_out(name, keyword, at, "its type is string".to_owned());
                return Ok(None);
            }
            // In text, shares of full colour.
            ("COLOR_SCALARS", Some(Values::F32(shares))) => {
                Values::U8(shares.iter().map(|share| (share * 255.0).round() as u8).collect())
            }
            (_, Some(values)) => values,
        };
        Ok(Some(Array { name: decoded(name), components, values }))
    }

    fn keep(&mut self, array: Option<Array>, role: Option<Role>) {
        if let (Some(array), Some((of, _))) = (array, self.current) {
            if let Some(role) = role {
                self.attributes[of].add_role(role, &array.name);
            }
            self.arrays[of].push(array);
        }
    }

    fn leave_out(&mut self, name: &str, keyword: &str, at: usize, what: String) {
        let name = decoded(name);
        let of = self.current.map_or(0, |current| current.0);
        let why = format!("{keyword} array \"{}\", at byte {at}: {what}", name.escape_debug());
        self.attributes[of].left_out.push(LeftOut { name, why });
    }
}

/// What comes before the numbers of an array of field data: its name, components, tuples and type.
fn described(from: &mut Scanner<'_>, name: &mut String) -> Result<Option<Described>, String> {
    *name = from.word("the name of an array")?;
    if name == "NULL_ARRAY" {
        return Ok(None);
    }
    let (components, tuples) = (from.count("its number of components")?, from.count("its number of tuples")?);
    let kind = Type::from_name(&from.word("its type")?, from.binary)?;
    Ok(Some(Described { name: name.clone(), components, tuples, kind }))
}

/// VTK writes the spaces and other odd characters of a name as `%20`.
pub(super) fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((byte, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        match code {
            Some(code) if *byte == b'%' => {
                bytes.push(code);
                rest = &after[2..];
            }
            _ => {
                bytes.push(*byte);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
