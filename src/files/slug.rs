//! Names that can be part of a file's name.

/// Most characters of a slug.
const MAX_SLUG: usize = 40;

/// A name as part of a file's name: lower-case ASCII letters, digits and hyphens; `otherwise` where nothing of it is
/// left.
pub fn slug(name: &str, otherwise: &str) -> String {
    let mut slug = String::new();
    for character in name.chars() {
        if character.is_ascii_alphanumeric() {
            slug.push(character.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
        if slug.len() == MAX_SLUG {
            break;
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() {
        otherwise.into()
    } else {
        slug.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_forms_a_path() {
        for (name, expected) in [
            ("Floor", "floor"),
            ("../../etc/passwd", "etc-passwd"),
            ("", "surface"),
            ("床", "surface"),
            ("a  b\0c", "a-b-c"),
            ("C:\\x", "c-x"),
        ] {
            assert_eq!(slug(name, "surface"), expected);
        }
        assert_eq!(slug(&"x".repeat(500), "surface").len(), MAX_SLUG);
    }
}
