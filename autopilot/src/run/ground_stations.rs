//! Addresses for ground stations: options, the configuration file, and the defaults.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::Path;
use std::str::FromStr;

use serde::Deserialize;

use host_io::Instance;

use crate::config::{self, ConfigError};
use crate::io::gcs_link::Links;
use mavlink_services::heartbeat::HeartbeatIdentity;

/// Where every vehicle calls `QGroundControl`.
const STATION_PORT: u16 = 14_550;
/// Where the first vehicle calls offboard scripts.
const SCRIPT_PORT: u16 = 14_540;
/// For ground stations that call: the port of PX4's simulation, and the step to that of the next vehicle.
const UDP_SERVER: (u16, u16) = (18_570, 1);
/// For ground stations that connect: the port of `ArduPilot`'s simulation, and the step.
const TCP_SERVER: (u16, u16) = (5_760, 10);

/// Ground stations that are called. From the eleventh vehicle on scripts share a port, as with PX4.
fn default_clients(instance: Instance) -> Vec<SocketAddr> {
    let station = local(STATION_PORT);
    vec![station, instance.local(SCRIPT_PORT, 1).min(local(STATION_PORT - 1))]
}

const fn local(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

/// An address with a port of at least `FIRST_PORT`, or none. Port 0 lets the system choose one to listen at; it cannot be called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "toml::Value")]
struct Endpoint<const FIRST_PORT: u16>(Option<SocketAddr>);

/// A ground station that is called.
type Client = Endpoint<1>;
/// Where ground stations call.
type Server = Endpoint<0>;

impl<const FIRST_PORT: u16> FromStr for Endpoint<FIRST_PORT> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self(None));
        }
        match text.parse::<SocketAddr>() {
            Err(_) => Err(format!("{text} is not IP:PORT or none")),
            Ok(address) if address.port() < FIRST_PORT => Err(format!(
                "{text} is not IP:PORT with a port from {FIRST_PORT} to 65535, or none"
            )),
            Ok(address) => Ok(Self(Some(address))),
        }
    }
}

impl<const FIRST_PORT: u16> TryFrom<toml::Value> for Endpoint<FIRST_PORT> {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, String> {
        value.as_str().map_or_else(|| value.to_string(), str::to_owned).parse()
    }
}

/// Options about ground stations.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct GroundStationArgs {
    /// Their addresses.
    #[command(flatten)]
    table: GroundStationTable,
    /// The autopilot that heartbeats name: of an unknown one ground stations show little more than telemetry
    #[arg(long = "mavlink-autopilot", value_enum, value_name = "NAME", default_value = "px4")]
    pub identity: HeartbeatIdentity,
    /// No ground stations at all
    #[arg(long, conflicts_with_all = ["clients", "bind", "udp_server", "tcp_server"])]
    no_gcs: bool,
}

/// What a configuration file may say.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfigFile {
    /// Where ground stations can be.
    #[serde(default)]
    pub ground_stations: GroundStationTable,
}

/// The table `[ground_stations]`, and the options of the same meaning.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, clap::Args)]
#[serde(deny_unknown_fields)]
pub struct GroundStationTable {
    /// Where a ground station listens; may be repeated [default: 127.0.0.1:14550, and :14540 + instance]
    #[arg(long = "gcs", value_name = "IP:PORT|none")]
    clients: Option<Vec<Client>>,
    /// Own address for calling them [default: any port of loopback, or of every address if one of them is elsewhere]
    #[arg(long = "gcs-bind", value_name = "IP:PORT")]
    bind: Option<SocketAddr>,
    /// Where ground stations can call by UDP [default: 127.0.0.1:18570 + instance]
    #[arg(long = "gcs-udp-server", value_name = "IP:PORT|none")]
    udp_server: Option<Server>,
    /// Where ground stations can connect by TCP [default: 127.0.0.1:5760 + 10 * instance]
    #[arg(long = "gcs-tcp", value_name = "IP:PORT|none")]
    tcp_server: Option<Server>,
}

impl ConfigFile {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        Self::from_toml(&path.display().to_string(), &config::read(path)?)
    }

    /// Reads the text of a file; `file` is its name for error messages.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        let syntax =
            |source| ConfigError::Syntax { file: file.to_owned(), source: Box::new(source) };
        toml::from_str(text).map_err(syntax)
    }
}

impl GroundStationArgs {
    /// The requested sockets; `None` if they are disabled.
    pub fn links(&self, file: &GroundStationTable, instance: Instance) -> Option<Links> {
        let options = &self.table;
        let clients = match options.clients.as_ref().or(file.clients.as_ref()) {
            None => default_clients(instance),
            Some(clients) => clients.iter().filter_map(|client| client.0).collect(),
        };
        let server = |option: Option<Server>, key: Option<Server>, (port, step): (u16, u16)| {
            option.or(key).map_or_else(|| Some(instance.local(port, step)), |server| server.0)
        };
        let links = Links {
            client_bind: options.bind.or(file.bind).unwrap_or_else(|| bind_for(&clients)),
            udp_server: server(options.udp_server, file.udp_server, UDP_SERVER),
            tcp_server: server(options.tcp_server, file.tcp_server, TCP_SERVER),
            clients,
        };
        let any =
            !links.clients.is_empty() || links.udp_server.is_some() || links.tcp_server.is_some();
        (any && !self.no_gcs).then_some(links)
    }
}

/// Local address for calling `clients`: loopback unless one of them is on another computer.
fn bind_for(clients: &[SocketAddr]) -> SocketAddr {
    let everywhere_4 = SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0));
    let everywhere_6 = SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0));
    match clients.first() {
        _ if clients.iter().all(|client| client.ip() == local(0).ip()) => local(0),
        Some(SocketAddr::V6(_)) => everywhere_6,
        Some(SocketAddr::V4(_)) | None => everywhere_4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Command, FromArgMatches};

    fn parse(options: &[&str]) -> Result<GroundStationArgs, clap::Error> {
        let command = GroundStationArgs::augment_args(Command::new("autopilot"));
        let words = ["autopilot"].iter().chain(options);
        GroundStationArgs::from_arg_matches(&command.try_get_matches_from(words)?)
    }

    fn links(options: &[&str], file: &str) -> Option<Links> {
        let file = ConfigFile::from_toml("my.toml", file).unwrap();
        parse(options).unwrap().links(&file.ground_stations, Instance::default())
    }

    fn at(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    const FILE: &str = r#"
        [ground_stations]
        clients = ["127.0.0.1:1", "192.0.2.7:2"]
        udp_server = "none"
        tcp_server = "127.0.0.1:3"
    "#;

    #[test]
    fn without_options_only_loopback_is_used() {
        let links = links(&[], "").unwrap();
        assert_eq!(links.clients, [at("127.0.0.1:14550"), at("127.0.0.1:14540")]);
        assert_eq!(links.client_bind, at("127.0.0.1:0"));
        assert_eq!(links.udp_server, Some(at("127.0.0.1:18570")));
        assert_eq!(links.tcp_server, Some(at("127.0.0.1:5760")));
    }

    #[test]
    fn further_vehicles_have_the_ports_that_those_of_px4_have() {
        let links = |number: &str| {
            let instance = number.parse().unwrap();
            let table = GroundStationTable::default();
            let links = parse(&[]).unwrap().links(&table, instance).unwrap();
            let ports: Vec<u16> = links.clients.iter().map(SocketAddr::port).collect();
            let servers = [links.udp_server, links.tcp_server].map(|at| at.unwrap().port());
            (ports, servers)
        };
        assert_eq!(links("1"), (vec![14_550, 14_541], [18_571, 5_770]));
        assert_eq!(links("9"), (vec![14_550, 14_549], [18_579, 5_850]));
        assert_eq!(links("249"), (vec![14_550, 14_549], [18_819, 8_250]));
        let file = ConfigFile::from_toml("my.toml", FILE).unwrap().ground_stations;
        let links = parse(&[]).unwrap().links(&file, "1".parse().unwrap()).unwrap();
        assert_eq!(links.tcp_server, Some(at("127.0.0.1:3")), "an address that is given stays");
    }

    #[test]
    fn the_command_line_wins_over_the_file() {
        let from_file = links(&[], FILE).unwrap();
        assert_eq!(from_file.clients, [at("127.0.0.1:1"), at("192.0.2.7:2")]);
        assert_eq!(from_file.client_bind, at("0.0.0.0:0"), "one of them is elsewhere");
        assert_eq!(from_file.udp_server, None);
        assert_eq!(from_file.tcp_server, Some(at("127.0.0.1:3")));
        let options = ["--gcs", "[::1]:4", "--gcs-tcp=none", "--gcs-udp-server=127.0.0.1:5"];
        let both = links(&options, FILE).unwrap();
        assert_eq!(both.clients, [at("[::1]:4")]);
        assert_eq!(both.udp_server, Some(at("127.0.0.1:5")));
        assert_eq!(both.tcp_server, None);
    }

    #[test]
    fn the_autopilot_that_heartbeats_name_is_px4_unless_another_is_requested() {
        assert_eq!(parse(&[]).unwrap().identity, HeartbeatIdentity::Px4);
        let generic = parse(&["--mavlink-autopilot", "generic"]).unwrap();
        assert_eq!(generic.identity, HeartbeatIdentity::Generic);
        assert!(parse(&["--mavlink-autopilot", "ardupilot"]).is_err());
    }

    #[test]
    fn everything_can_be_switched_off() {
        assert_eq!(links(&["--no-gcs"], ""), None);
        let off = ["--gcs", "none", "--gcs-udp-server", "none", "--gcs-tcp", "none"];
        assert_eq!(links(&off, FILE), None);
        assert_eq!(links(&["--gcs", "none"], "").unwrap().clients, []);
    }

    #[test]
    fn wrong_addresses_are_refused_with_the_allowed_form() {
        for option in ["--gcs=here", "--gcs-tcp=5760", "--gcs-udp-server=localhost:1"] {
            let message = parse(&[option]).unwrap_err().to_string();
            assert!(message.contains("IP:PORT or none"), "{message}");
        }
        for station in ["--gcs=127.0.0.1:0", "--gcs=[::1]:0"] {
            let message = parse(&[station]).unwrap_err().to_string();
            assert!(message.contains("1 to 65535"), "{message}");
        }
        for (line, words) in [
            ("tcp_server = \"5760\"", ["tcp_server", "\"5760\"", "IP:PORT or none"]),
            ("udp_server = 18570", ["udp_server", "18570", "IP:PORT or none"]),
            ("clients = [\"here\"]", ["clients", "here", "IP:PORT or none"]),
            ("clients = [\"127.0.0.1:0\"]", ["clients", "127.0.0.1:0", "1 to 65535"]),
            ("tcp = \"none\"", ["my.toml", "`tcp`", "tcp_server"]),
        ] {
            let text = format!("[ground_stations]\n{line}\n");
            let message = ConfigFile::from_toml("my.toml", &text).unwrap_err().to_string();
            assert!(message.starts_with("my.toml: "), "{message}");
            for word in words {
                assert!(message.contains(word), "{word} is missing: {message}");
            }
        }
    }
}
