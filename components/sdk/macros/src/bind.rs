//! Writes the bindings, the types in scope and the exports.
//!
//! What an author's `#[block("latchwork:device/ton")] impl Ton { … }` becomes:
//!
//! ```text
//! mod __latchwork_ton { bindings by wit-bindgen; `types`: what the author sees }
//! use __latchwork_ton::types::*;
//! const _: () = { impl Ton { … }  one static instance, the exports (on wasm32), the documentation as a section };
//! ```

use crate::args::Args;
use crate::class::{self, Class};
use crate::{check, wit};
use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};
use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{Error, Ident, Item, ItemImpl};
use wit_bindgen_rust::{Opts, WithOption};
use wit_parser::{Resolve, Type, TypeDefKind, TypeId, WorldId};

const SHARED: &str = "latchwork:block/types@0.1.0";

/// Expands `#[block]`.
pub(crate) fn block(args: TokenStream, item: TokenStream) -> TokenStream {
    match expand(args, item) {
        Ok((code, errors)) => {
            let errors = errors.iter().map(Error::to_compile_error);
            quote!(#(#errors)* #code)
        }
        // Without the class the impl would only add errors of its own about types that are not there.
        Err(e) => e.into_compile_error(),
    }
}

/// The code, and what does not fit: with the types in scope, rustc adds nothing that follows from it.
pub(crate) fn expand(args: TokenStream, item: TokenStream) -> syn::Result<(TokenStream, Vec<Error>)> {
    let args: Args = syn::parse2(args)?;
    let item = check::item(syn::parse2::<Item>(item)?, &args.class.value())?;
    let mut found = wit::find(&args)?;
    let at_class = |message: String| Error::new(args.class.span(), message);
    let class = class::read(&found.resolve, found.interface).map_err(at_class)?;
    let docs = class::docs(&found.resolve, found.interface);
    let defaults = defaults(&found.resolve, &class);
    let world = wit::export_world(&mut found.resolve, found.interface).map_err(|e| at_class(format!("{e:#}")))?;
    let bindings = bindings(&mut found.resolve, world).map_err(|e| at_class(format!("{e:#}")))?;

    let module = format_ident!("__latchwork_{}", args.interface.to_snake_case());
    let path: Vec<Ident> = class.module.iter().map(|m| Ident::new(m, Span::call_site())).collect();
    let names = in_scope(&found.resolve, &class);
    let files = found.files.iter().map(|f| f.display().to_string());
    let errors = check::differences(&item, &class, &args.class.value());
    let exports = if errors.is_empty() { exports(&item, &class, &module, &path, &docs) } else { quote!() };
    let own = names.own;
    let shared = names.shared;
    let scope: Vec<&Ident> = own.iter().chain(&shared).collect();
    let code = quote! {
        #[doc(hidden)]
        #[allow(warnings)]
        mod #module {
            pub mod bindings { #bindings }
            pub mod types {
                pub use super::bindings::exports::#(#path)::*::{#(#own),*};
                pub use ::latchwork_sdk::types::{#(#shared),*};
                #defaults
            }
            #(const _: &[u8] = include_bytes!(#files);)*
        }
        #[allow(unused_imports)]
        use self::#module::types::*;
        const _: () = {
            #[allow(unused_imports)]
            use self::#module::types::{#(#scope),*};
            #item
            #exports
        };
    };
    Ok((code, errors))
}

/// Expands `__shared!`: the types and the log as the SDK re-exports them.
pub(crate) fn shared() -> TokenStream {
    let expand = || -> anyhow::Result<TokenStream> {
        let mut resolve = wit::embedded(&[latchwork_wit::BLOCK]).map_err(|e| anyhow::anyhow!("{e}"))?;
        let items = "import latchwork:block/types@0.1.0; import latchwork:block/log@0.1.0;";
        let world = wit::push_world(&mut resolve, "shared", items)?;
        generate(&mut resolve, world, Opts { generate_unused_types: true, ..options() })
    };
    expand().unwrap_or_else(|e| Error::new(Span::call_site(), format!("{e:#}")).to_compile_error())
}

fn options() -> Opts {
    Opts {
        runtime_path: Some("::latchwork_sdk::rt::wit".into()),
        bitflags_path: Some("::latchwork_sdk::rt::wit::bitflags".into()),
        additional_derive_attributes: vec!["PartialEq".into()],
        generate_all: true,
        ..Opts::default()
    }
}

fn bindings(resolve: &mut Resolve, world: WorldId) -> anyhow::Result<TokenStream> {
    let mut options = options();
    let uses_shared = resolve.worlds[world].imports.keys().any(|key| resolve.name_world_key(key) == SHARED);
    if uses_shared {
        options.with = vec![(SHARED.into(), WithOption::Path("::latchwork_sdk::types".into()))];
    }
    generate(resolve, world, options)
}

fn generate(resolve: &mut Resolve, world: WorldId, options: Opts) -> anyhow::Result<TokenStream> {
    use wit_bindgen_core::{Files, WorldGenerator};
    let mut files = Files::default();
    options.build().generate(resolve, world, &mut files)?;
    let (_, source) = files.iter().next().ok_or_else(|| anyhow::anyhow!("wit-bindgen wrote nothing"))?;
    let source = without_examples(std::str::from_utf8(source)?);
    source.parse().map_err(|e| anyhow::anyhow!("bindings are no Rust: {e}"))
}

/// Leaves out comments with an example of wit-bindgen's own: in the author's crate it would run as a doc test.
fn without_examples(source: &str) -> String {
    let mut out = String::with_capacity(source.len());
    let mut comment = String::new();
    for line in source.lines() {
        let is_comment = line.trim_start().starts_with("///");
        if !is_comment && !comment.is_empty() {
            if !comment.contains("macro_rules!") {
                out.push_str(&comment);
            }
            comment.clear();
        }
        let to = if is_comment { &mut comment } else { &mut out };
        to.push_str(line);
        to.push('\n');
    }
    out
}

struct Names {
    own: Vec<Ident>,
    shared: Vec<Ident>,
}

/// The types an author sees: the class's own, and the shared ones it uses.
fn in_scope(resolve: &Resolve, class: &Class) -> Names {
    let mut names = Names { own: Vec::new(), shared: Vec::new() };
    let ident = |name: &str| Ident::new(name, Span::call_site());
    let mut signals = false;
    for ty in &class.types {
        match class::shared_type(resolve, ty.id) {
            Some(shared) => {
                signals |= shared.ends_with("-signal");
                names.shared.push(ident(&shared.to_upper_camel_case()));
            }
            None => names.own.push(ident(&ty.rust)),
        }
    }
    let quality = ident("Quality");
    if signals && !names.shared.contains(&quality) {
        names.shared.push(quality);
    }
    names
}

/// `Default` for every type of the class: zeros, empty flags, the first case of an enum.
fn defaults(resolve: &Resolve, class: &Class) -> TokenStream {
    let mut code = TokenStream::new();
    for ty in class.types.iter().filter(|t| t.own) {
        let name = Ident::new(&ty.rust, Span::call_site());
        let value = match &resolve.types[ty.id].kind {
            TypeDefKind::Record(record) if record.fields.iter().all(|f| has_default(resolve, class, &f.ty)) => {
                let fields = record.fields.iter().map(|f| field(&f.name));
                quote!(Self { #(#fields: ::core::default::Default::default()),* })
            }
            TypeDefKind::Flags(_) => quote!(Self::empty()),
            TypeDefKind::Enum(cases) => match cases.cases.first() {
                Some(first) => {
                    let first = Ident::new(&first.name.to_upper_camel_case(), Span::call_site());
                    quote!(Self::#first)
                }
                None => continue,
            },
            _ => continue,
        };
        code.extend(quote! {
            impl ::core::default::Default for #name { fn default() -> Self { #value } }
        });
    }
    code
}

fn has_default(resolve: &Resolve, class: &Class, ty: &Type) -> bool {
    let Type::Id(id) = ty else { return true };
    if class::shared_type(resolve, *id).is_some() {
        return true;
    }
    match &resolve.types[*id].kind {
        TypeDefKind::Type(inner) => has_default(resolve, class, inner),
        kind => {
            is_own(class, *id)
                && match kind {
                    TypeDefKind::Record(record) => record.fields.iter().all(|f| has_default(resolve, class, &f.ty)),
                    TypeDefKind::Flags(_) | TypeDefKind::Enum(_) => true,
                    _ => false,
                }
        }
    }
}

fn is_own(class: &Class, id: TypeId) -> bool {
    class.types.iter().any(|t| t.own && t.id == id)
}

/// A field as wit-bindgen names it.
fn field(name: &str) -> Ident {
    let name = name.to_snake_case();
    let keyword = syn::parse_str::<Ident>(&name).is_err();
    Ident::new(&if keyword { format!("{name}_") } else { name }, Span::call_site())
}

/// The instance, the bindings' trait on it, and on wasm32 the exports and the documentation.
fn exports(item: &ItemImpl, class: &Class, module: &Ident, path: &[Ident], docs: &serde_json::Value) -> TokenStream {
    let block = &item.self_ty;
    let methods = class.functions.iter().map(|function| {
        let name = Ident::new(function.name, Span::call_site());
        let parameters: Vec<Ident> =
            function.parameters.iter().map(|(n, _)| Ident::new(n, Span::call_site())).collect();
        let types = function.parameters.iter().map(|(_, t)| Ident::new(t, Span::call_site()));
        let call = match function.name {
            "defaults" => quote!(<#block>::defaults()),
            "configure" => {
                quote!(INSTANCE.with(new, |block| ::latchwork_sdk::rt::refusal(block.configure(#(#parameters),*))))
            }
            _ => quote!(INSTANCE.with(new, |block| block.#name(#(#parameters),*))),
        };
        let result = match (function.name, &function.result) {
            ("configure", _) => quote!(-> ::core::result::Result<(), ::latchwork_sdk::String>),
            (_, Some(result)) => {
                let result: TokenStream = result.parse().unwrap_or_default();
                quote!(-> #result)
            }
            (_, None) => quote!(),
        };
        quote!(fn #name(#(#parameters: #types),*) #result { #call })
    });
    let section = serde_json::json!({ &class.id: docs }).to_string();
    let bytes = Literal::byte_string(section.as_bytes());
    let length = section.len();
    let docs = Ident::new(&format!("DOCS_{}", module.to_string().to_shouty_snake_case()), Span::call_site());
    // Only here is `Default` needed, and at the struct's name, so that its lack is one message there.
    let new = quote_spanned!(block.span()=> fn new() -> #block { <#block as ::core::default::Default>::default() });
    quote! {
        #new
        static INSTANCE: ::latchwork_sdk::rt::Instance<#block> = ::latchwork_sdk::rt::Instance::new();
        #[doc(hidden)]
        struct Exports;
        impl self::#module::bindings::exports::#(#path)::*::Guest for Exports { #(#methods)* }
        #[cfg(target_arch = "wasm32")]
        self::#module::bindings::export!(Exports with_types_in self::#module::bindings);
        #[cfg(target_arch = "wasm32")]
        #[unsafe(link_section = "latchwork-docs")]
        static #docs: [u8; #length] = *#bytes;
    }
}
