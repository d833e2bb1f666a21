//! The world as a logger sees it.

use super::grants::Grants;
use super::limiter::Limiter;
use super::said::Said;
use latchwork_block::Level;
use std::net::SocketAddr;
use wasmtime::component::{Linker, ResourceTable};
use wasmtime::{Engine, Result, StoreContextMut};
use wasmtime_wasi::sockets::SocketAddrUse;
use wasmtime_wasi::{FsPerms, WasiCtx, WasiCtxView, WasiView};

/// Where a logger finds its directory.
pub(super) const DIRECTORY: &str = "/data";

/// Files, sockets and streams that a logger may have open at once: the process has to share its own with the drivers.
pub(super) const RESOURCES: usize = 256;
/// Most random bytes at once.
const RANDOM: u64 = 64 << 10;

/// State of one instance.
pub(super) struct World {
    wasi: WasiCtx,
    table: ResourceTable,
    pub(super) limiter: Limiter,
    pub(super) said: Said,
}

impl WasiView for World {
    fn ctx(&mut self) -> WasiCtxView<'_> {
        WasiCtxView { ctx: &mut self.wasi, table: &mut self.table }
    }
}

impl World {
    /// With what the plant file grants, and no more. Makes the directory.
    ///
    /// # Errors
    /// A directory that is not to be had.
    pub(super) fn new(grants: &Grants) -> Result<Self, String> {
        let said = Said::default();
        let mut wasi = WasiCtx::builder();
        wasi.stdout(said.clone()).stderr(said.clone()).max_random_size(RANDOM);
        wasi.allow_udp(false).allow_ip_name_lookup(false).allow_tcp(!grants.connect.is_empty());
        let allowed = grants.connect.clone();
        wasi.socket_addr_check(move |address, usage| {
            let granted = may(&allowed, address, usage);
            Box::pin(std::future::ready(granted))
        });
        if let Some(directory) = &grants.directory {
            let no = |e: &dyn std::fmt::Display| format!("the directory {} is not to be had: {e}", directory.display());
            std::fs::create_dir_all(directory).map_err(|e| no(&e))?;
            wasi.preopened_dir(directory, DIRECTORY, FsPerms::ReadWrite).map_err(|e| no(&e))?;
        }
        let mut table = ResourceTable::new();
        table.set_max_capacity(RESOURCES);
        Ok(Self { wasi: wasi.build(), table, limiter: Limiter::new(grants.memory), said })
    }
}

/// Connects to a granted address alone, from whatever port the system gives.
fn may(allowed: &[SocketAddr], address: SocketAddr, usage: SocketAddrUse) -> bool {
    match usage {
        SocketAddrUse::TcpConnect => allowed.contains(&address),
        SocketAddrUse::TcpBind => address.ip().is_unspecified() && address.port() == 0,
        _ => false,
    }
}

/// WASI 0.2 and the log.
pub(super) fn linker(engine: &Engine) -> Result<Linker<World>> {
    let mut linker = Linker::new(engine);
    wasmtime_wasi::p2::add_to_linker_async(&mut linker)?;
    linker.instance("latchwork:block/log@0.1.0")?.func_wrap("write", write)?;
    Ok(linker)
}

/// `latchwork:block/log.write`
fn write(store: StoreContextMut<'_, World>, (level, message): (Level, String)) -> Result<()> {
    if level > Level::Debug {
        store.data().said.push(message.replace('\n', " ").as_bytes());
        store.data().said.push(b"\n");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logger_connects_where_it_may_and_listens_nowhere() {
        use SocketAddrUse::{TcpAccept, TcpBind, TcpConnect, TcpListen, UdpBind, UdpSend};
        let granted: SocketAddr = "127.0.0.1:5140".parse().expect("an address");
        let any: SocketAddr = "0.0.0.0:0".parse().expect("an address");
        let other: SocketAddr = "127.0.0.1:5141".parse().expect("an address");
        let may = |address, usage| may(&[granted], address, usage);
        assert!(may(granted, TcpConnect) && may(any, TcpBind));
        assert!(!may(other, TcpConnect));
        assert!(!may(granted, TcpBind) && !may(other, TcpBind));
        for usage in [TcpListen, TcpAccept, UdpBind, UdpSend] {
            assert!(!may(granted, usage) && !may(any, usage), "{usage:?}");
        }
    }
}
