//! The arguments of `#[block("package:name/class@version", wit = "folder")]`.

use syn::parse::{Parse, ParseStream};
use syn::{Error, Ident, LitStr, Result, Token};

const EXAMPLE: &str = "expected the device class:\n\n    \
                       #[block(\"latchwork:device/ton\")]\n    \
                       #[block(\"workshop:drives/conveyor\", wit = \"wit\")]";

/// What the author wrote in the attribute.
pub(crate) struct Args {
    /// The class as written.
    pub(crate) class: LitStr,
    /// `namespace:package`.
    pub(crate) package: String,
    /// The interface.
    pub(crate) interface: String,
    /// The version, when given.
    pub(crate) version: Option<String>,
    /// The folder of the author's own WIT package, relative to Cargo.toml.
    pub(crate) wit: Option<LitStr>,
}

impl Parse for Args {
    fn parse(input: ParseStream<'_>) -> Result<Self> {
        if input.is_empty() {
            return Err(Error::new(input.span(), EXAMPLE));
        }
        let class: LitStr = input.parse().map_err(|e| Error::new(e.span(), EXAMPLE))?;
        let mut wit = None;
        while !input.is_empty() {
            input.parse::<Token![,]>()?;
            if input.is_empty() {
                break;
            }
            let key: Ident = input.parse()?;
            if key != "wit" {
                return Err(Error::new(key.span(), format!("unknown argument `{key}`; expected `wit = \"folder\"`")));
            }
            input.parse::<Token![=]>()?;
            wit = Some(input.parse()?);
        }
        let text = class.value();
        let (name, version) = match text.split_once('@') {
            Some((name, version)) => (name, Some(version.to_owned())),
            None => (text.as_str(), None),
        };
        match name.split_once('/') {
            Some((package, interface)) if package.split(':').filter(|p| !p.is_empty()).count() == 2 => {
                let (package, interface) = (package.to_owned(), interface.to_owned());
                Ok(Self { class, package, interface, version, wit })
            }
            _ => Err(Error::new(class.span(), format!("`{text}` names no device class; {EXAMPLE}"))),
        }
    }
}
