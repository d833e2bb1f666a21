//! Compares the author's impl with the class and says, at the author's code, what does not fit.

use crate::class::{Class, Function};
use crate::names::nearest;
use quote::ToTokens;
use syn::spanned::Spanned;
use syn::{Error, FnArg, GenericArgument, ImplItem, ImplItemFn, Item, ItemImpl, PathArguments, ReturnType, Type};

/// The impl that the attribute stands on.
pub(crate) fn item(item: Item, class: &str) -> Result<ItemImpl, Error> {
    match item {
        Item::Impl(item) => Ok(item),
        Item::Struct(item) => Err(Error::new(
            item.struct_token.span,
            format!(
                "#[block] goes on the impl, not on the struct:\n\n    #[block(\"{class}\")]\n    impl {} {{ … }}",
                item.ident
            ),
        )),
        other => Err(Error::new(
            other.span(),
            format!("#[block] goes on the impl of a struct:\n\n    #[block(\"{class}\")]\n    impl MyBlock {{ … }}"),
        )),
    }
}

/// Every difference between the impl and the class, `shown` being the class as the author names it.
pub(crate) fn differences(item: &ItemImpl, class: &Class, shown: &str) -> Vec<Error> {
    let mut errors = Vec::new();
    if let Some((_, path, _)) = &item.trait_ {
        return vec![Error::new(path.span(), "#[block] goes on an impl of the struct itself, not of a trait")];
    }
    if !item.generics.params.is_empty() {
        errors.push(Error::new(item.generics.span(), "a block has no generic parameters: a component is one instance"));
    }
    let name = item.self_ty.to_token_stream().to_string();
    let mut missing: Vec<&Function> = class.functions.iter().collect();
    for function in item.items.iter().filter_map(|i| if let ImplItem::Fn(f) = i { Some(f) } else { None }) {
        let ident = function.sig.ident.to_string();
        match class.functions.iter().find(|f| f.name == ident) {
            Some(expected) => {
                missing.retain(|f| f.name != ident);
                compare(function, expected, shown, &mut errors);
            }
            None => {
                let names = || class.functions.iter().map(|f| f.name);
                let meant = nearest(&ident, names());
                // A slip of the fingers is one mistake, not two.
                missing.retain(|f| Some(f.name) != meant);
                let way_out = match meant {
                    Some(meant) => format!("; did you mean `{meant}`?"),
                    None => format!(
                        ", which has {}\na function of your own goes into an `impl {name}` without #[block]",
                        names().collect::<Vec<_>>().join(", ")
                    ),
                };
                let message = format!("`{ident}` is no function of {shown}{way_out}");
                errors.push(Error::new(function.sig.ident.span(), message));
            }
        }
    }
    if !missing.is_empty() {
        let list: String = missing.iter().map(|f| format!("\n    {} {{ … }}", f.signature())).collect();
        let names: Vec<String> = missing.iter().map(|f| format!("`{}`", f.name)).collect();
        let message = format!("`{name}` lacks {} of {shown}; add\n{list}", names.join(", "));
        errors.push(Error::new(item.self_ty.span(), message));
    }
    errors
}

fn compare(found: &ImplItemFn, expected: &Function, shown: &str, errors: &mut Vec<Error>) {
    let sig = &found.sig;
    let name = expected.name;
    if !sig.generics.params.is_empty() || sig.asyncness.is_some() {
        errors.push(Error::new(sig.span(), format!("`{name}` is a plain function: neither generic nor async")));
    }
    let receiver = sig.receiver();
    let receiver_fits = match expected.receiver {
        None => receiver.is_none(),
        // `&self` where `&mut self` is possible, and the other way round, are both sound: there is one instance.
        Some(_) => receiver.is_some_and(|r| r.reference.is_some()),
    };
    let types: Vec<&Type> =
        sig.inputs.iter().filter_map(|a| if let FnArg::Typed(t) = a { Some(&*t.ty) } else { None }).collect();
    let types_fit = types.len() == expected.parameters.len()
        && types.iter().zip(&expected.parameters).all(|(ty, (_, name))| is_named(ty, name));
    if !receiver_fits || !types_fit {
        let takes = expected.parameter_list();
        errors.push(Error::new(sig.paren_token.span.join(), format!("`{name}` of {shown} takes ({takes})")));
    }
    if !returns(&sig.output, expected.result.as_deref()) {
        let result = expected.result.as_deref().unwrap_or("nothing");
        let span = match &sig.output {
            ReturnType::Type(_, ty) => ty.span(),
            ReturnType::Default => sig.ident.span(),
        };
        errors.push(Error::new(span, format!("`{name}` of {shown} returns {result}")));
    }
}

/// Whether a type is written as `name`, with or without a path before it.
fn is_named(ty: &Type, name: &str) -> bool {
    matches!(ty, Type::Path(p) if p.path.segments.last().is_some_and(|s| s.ident == name && s.arguments.is_none()))
}

fn returns(found: &ReturnType, expected: Option<&str>) -> bool {
    let unit = |ty: &Type| matches!(ty, Type::Tuple(t) if t.elems.is_empty());
    match (found, expected) {
        (ReturnType::Default, None) => true,
        (ReturnType::Type(_, ty), None) => unit(ty),
        (ReturnType::Default, Some(_)) => false,
        (ReturnType::Type(_, ty), Some("Result<(), String>")) => {
            // Any error that can be shown will do; the compiler checks that.
            let Type::Path(path) = &**ty else { return false };
            let Some(last) = path.path.segments.last() else { return false };
            let PathArguments::AngleBracketed(arguments) = &last.arguments else { return last.ident == "Result" };
            last.ident == "Result" && matches!(arguments.args.first(), Some(GenericArgument::Type(ty)) if unit(ty))
        }
        (ReturnType::Type(_, ty), Some("(Outputs, Alarms)")) => match &**ty {
            Type::Tuple(t) if t.elems.len() == 2 => is_named(&t.elems[0], "Outputs") && is_named(&t.elems[1], "Alarms"),
            _ => false,
        },
        (ReturnType::Type(_, ty), Some(name)) => is_named(ty, name),
    }
}
