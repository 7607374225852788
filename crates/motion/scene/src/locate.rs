//! Where in the text of a file a path leads.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Line and column, both from 1, of what a path as in [`crate::Problem`] names; of the nearest that is
/// there where it names something missing. `None` in a text that is no TOML, and for `$` alone.
pub fn place(text: &str, path: &str) -> Option<(usize, usize)> {
    let document = DeTable::parse(text).ok()?;
    let mut found = None;
    let mut here: Option<&Spanned<DeValue<'_>>> = None;
    for step in steps(path.strip_prefix('$')?) {
        let next = match (step, here.map(Spanned::get_ref)) {
            (Step::Key(key), None) => document.get_ref().get(key),
            (Step::Key(key), Some(DeValue::Table(table))) => table.get(key),
            (Step::Index(index), Some(DeValue::Array(array))) => array.get(index),
            _ => None,
        };
        let Some(next) = next else { break };
        found = Some(next.span().start);
        here = Some(next);
    }
    let before = text.get(..found?)?;
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    Some((line, column))
}

enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

/// `.target[1].weight` one by one, up to what is not understood.
fn steps(mut path: &str) -> impl Iterator<Item = Step<'_>> {
    std::iter::from_fn(move || {
        if let Some(rest) = path.strip_prefix('.') {
            let end = rest.find(['.', '[']).unwrap_or(rest.len());
            path = &rest[end..];
            return Some(Step::Key(&rest[..end]));
        }
        let (index, rest) = path.strip_prefix('[')?.split_once(']')?;
        path = rest;
        Some(Step::Index(index.parse().ok()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "format = 1\n[[object]]\nname = \"a\"\n\n[[object]]\nname = \"ä\"\n\
                        kind.box = { size = [1, 2, 3], mass = 4 }\n";

    #[test]
    fn a_path_leads_to_its_line() {
        assert_eq!(place(TEXT, "$.format"), Some((1, 10)));
        assert_eq!(place(TEXT, "$.object[1].name"), Some((6, 8)));
        assert_eq!(place(TEXT, "$.object[1].kind.box.size[2]"), Some((7, 28)));
    }

    #[test]
    fn what_is_missing_is_looked_for_where_it_should_be() {
        assert_eq!(place(TEXT, "$.object[1].yaw"), place(TEXT, "$.object[1]"));
        assert_eq!(place(TEXT, "$.object[1]").unwrap().0, 5);
        for nowhere in ["$", "", "object", "$.nothing", "$[", "$.a[99999999999999999999999]"] {
            assert_eq!(place(TEXT, nowhere), None, "{nowhere}");
        }
        assert_eq!(place("= 1", "$.format"), None);
    }
}
