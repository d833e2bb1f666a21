//! The routes, as a table: what is in it is served, and docs/openapi.json describes exactly this.

mod alarms;
mod change;
mod read;
mod records;
mod swaps;
mod watch;

use crate::reply::Failure;
use crate::server::Shared;
use axum::Router;
use axum::http::{Method, Uri};
use axum::routing::{MethodRouter, delete, get, post};
use std::sync::Arc;

/// One method of one path.
pub(crate) struct Route {
    /// In small letters, as OpenAPI has it.
    #[cfg_attr(
        not(test),
        expect(dead_code, reason = "the router knows it; the test of the document does not ask the router")
    )]
    pub(crate) method: &'static str,
    pub(crate) path: &'static str,
    handler: MethodRouter<Arc<Shared>>,
}

fn on_get<T: 'static, H: axum::handler::Handler<T, Arc<Shared>>>(path: &'static str, handler: H) -> Route {
    Route { method: "get", path, handler: get(handler) }
}

fn on_post<T: 'static, H: axum::handler::Handler<T, Arc<Shared>>>(path: &'static str, handler: H) -> Route {
    Route { method: "post", path, handler: post(handler) }
}

fn on_delete<T: 'static, H: axum::handler::Handler<T, Arc<Shared>>>(path: &'static str, handler: H) -> Route {
    Route { method: "delete", path, handler: delete(handler) }
}

/// Everything that is served.
pub(crate) fn table() -> Vec<Route> {
    vec![
        on_get("/", read::greeting),
        on_get("/openapi.json", read::document),
        on_get("/v1/status", read::status),
        on_get("/v1/tags", read::tags),
        on_get("/v1/watch", watch::watch),
        on_post("/v1/settings", change::set),
        on_get("/v1/settings/{block}", read::settings),
        on_post("/v1/settings/{block}/write", change::write),
        on_post("/v1/settings/{block}/discard", change::discard),
        on_get("/v1/forces", read::forces),
        on_post("/v1/forces", change::force),
        on_delete("/v1/forces", change::unforce),
        on_post("/v1/commands", change::command),
        on_get("/v1/alarms", alarms::list),
        on_post("/v1/alarms/acknowledge", alarms::acknowledge),
        on_post("/v1/alarms/reset", alarms::reset),
        on_post("/v1/alarms/shelve", alarms::shelve),
        on_post("/v1/alarms/unshelve", alarms::unshelve),
        on_post("/v1/alarms/out-of-service", alarms::out_of_service),
        on_post("/v1/alarms/in-service", alarms::in_service),
        on_get("/v1/records", records::records),
        on_get("/v1/recording", read::recording),
        on_post("/v1/heartbeat", change::heartbeat),
        on_get("/v1/swaps", swaps::list),
        on_post("/v1/swaps", swaps::start),
        on_get("/v1/swaps/{number}", swaps::one),
        on_post("/v1/swaps/{number}/cancel", swaps::cancel),
        on_post("/v1/blocks/{block}/rollback", swaps::rollback),
    ]
}

/// The service of every connection.
pub(crate) fn router(shared: Arc<Shared>) -> Router {
    let missing = async |uri: Uri| Failure::no_route(uri.path());
    let not_so = async |method: Method, uri: Uri| Failure::no_method(method.as_str(), uri.path());
    let all = table().into_iter().fold(Router::new(), |router, route| router.route(route.path, route.handler));
    all.fallback(missing).method_not_allowed_fallback(not_so).with_state(shared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;
    use std::collections::BTreeSet;

    fn document() -> Value {
        serde_json::from_str(crate::OPENAPI).expect("docs/openapi.json is JSON")
    }

    #[test]
    fn the_document_has_every_route_and_no_other() {
        let document = document();
        assert!(document["openapi"].as_str().is_some_and(|v| v.starts_with("3.1.")));
        let served: BTreeSet<_> = table().iter().map(|r| format!("{} {}", r.method, r.path)).collect();
        let paths = document["paths"].as_object().expect("paths");
        let methods = ["get", "post", "put", "patch", "delete", "head", "options", "trace"];
        let described = paths.iter().flat_map(|(path, item)| {
            let of_path = item.as_object().expect("an object").keys().filter(|m| methods.contains(&m.as_str()));
            of_path.map(move |method| format!("{method} {path}")).collect::<Vec<_>>()
        });
        assert_eq!(described.collect::<BTreeSet<_>>(), served);
    }

    #[test]
    fn every_reference_of_the_document_leads_somewhere() {
        fn references(value: &Value, found: &mut Vec<String>) {
            match value {
                Value::Object(map) => map.iter().for_each(|(key, v)| match v {
                    Value::String(target) if key == "$ref" => found.push(target.clone()),
                    v => references(v, found),
                }),
                Value::Array(list) => list.iter().for_each(|v| references(v, found)),
                _ => {}
            }
        }
        let document = document();
        let mut found = Vec::new();
        references(&document, &mut found);
        assert!(found.len() > 20, "{found:?}");
        for target in found {
            let pointer = target.strip_prefix('#').unwrap_or_else(|| panic!("{target} leads out of the document"));
            assert!(document.pointer(pointer).is_some(), "{target} leads nowhere");
        }
    }
}
