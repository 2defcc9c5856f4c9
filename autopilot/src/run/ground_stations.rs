//! Addresses for ground stations: options, the configuration file, and the defaults.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::Path;
use std::str::FromStr;

use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

use host_io::Instance;

use crate::config::{self, ConfigError};
use crate::io::gcs_link::Links;
use mavlink_services::heartbeat::HeartbeatIdentity;

/// Where every vehicle calls `QGroundControl`.
const STATION_PORT: u16 = 14_550;
/// Where the first vehicle calls offboard scripts.
const SCRIPT_PORT: u16 = 14_540;
/// For ground stations that call: the port of PX4's simulation.
const UDP_SERVER_PORT: u16 = 18_570;
/// For ground stations that connect: the port of `ArduPilot`'s simulation, and the step to that of the next vehicle.
const TCP_SERVER: (u16, u16) = (5_760, 10);

/// Ground stations that are called. From the eleventh vehicle on scripts share a port, as with PX4.
fn default_clients(instance: Instance) -> Vec<SocketAddr> {
    let station = local(STATION_PORT);
    vec![station, instance.local(SCRIPT_PORT, 1).min(local(STATION_PORT - 1))]
}

const fn local(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

/// An address, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endpoint {
    /// This one.
    At(SocketAddr),
    /// None.
    None,
}

/// The allowed form of an endpoint.
const FORM: &str = "IP:PORT or none";

impl Endpoint {
    fn address(self) -> Option<SocketAddr> {
        match self {
            Self::At(address) => Some(address),
            Self::None => None,
        }
    }
}

impl FromStr for Endpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        text.parse().map(Self::At).map_err(|_| format!("{text} is not {FORM}"))
    }
}

impl<'de> Deserialize<'de> for Endpoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(EndpointVisitor)
    }
}

struct EndpointVisitor;

impl Visitor<'_> for EndpointVisitor {
    type Value = Endpoint;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{FORM} as a string")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Endpoint, E> {
        text.parse().map_err(|_| E::invalid_value(Unexpected::Str(text), &self))
    }
}

/// An address that is called, or none. Port 0, which lets the system choose one to listen at, cannot be called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Client(Endpoint);

/// The allowed form of a client.
const CLIENT_FORM: &str = "IP:PORT with a port from 1 to 65535, or none";

impl FromStr for Client {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse() {
            Ok(Endpoint::At(address)) if address.port() == 0 => {
                Err(format!("{text} is not {CLIENT_FORM}"))
            }
            endpoint => endpoint.map(Self),
        }
    }
}

impl<'de> Deserialize<'de> for Client {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Endpoint::deserialize(deserializer)? {
            Endpoint::At(address) if address.port() == 0 => {
                Err(serde::de::Error::custom(format!("{address} is not {CLIENT_FORM}")))
            }
            endpoint => Ok(Self(endpoint)),
        }
    }
}

/// Options about ground stations.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct GroundStationArgs {
    /// Where a ground station listens; may be repeated [default: 127.0.0.1:14550, and :14540 + instance]
    #[arg(long = "gcs", value_name = "IP:PORT|none")]
    clients: Vec<Client>,
    /// Own address for calling them [default: any port of loopback, or of every address if one of them is elsewhere]
    #[arg(long = "gcs-bind", value_name = "IP:PORT")]
    bind: Option<SocketAddr>,
    /// Where ground stations can call by UDP [default: 127.0.0.1:18570 + instance]
    #[arg(long = "gcs-udp-server", value_name = "IP:PORT|none")]
    udp_server: Option<Endpoint>,
    /// Where ground stations can connect by TCP [default: 127.0.0.1:5760 + 10 * instance]
    #[arg(long = "gcs-tcp", value_name = "IP:PORT|none")]
    tcp_server: Option<Endpoint>,
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

/// The table `[ground_stations]`; each key as the option of the same meaning.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundStationTable {
    /// Ground stations that are called; none if empty.
    clients: Option<Vec<Client>>,
    /// Own address for calling them.
    bind: Option<SocketAddr>,
    /// Where they can call by UDP.
    udp_server: Option<Endpoint>,
    /// Where they can connect by TCP.
    tcp_server: Option<Endpoint>,
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
        let clients: Vec<SocketAddr> = match (self.clients.as_slice(), &file.clients) {
            ([], None) => default_clients(instance),
            ([], Some(clients)) => clients.iter().filter_map(|client| client.0.address()).collect(),
            (clients, _) => clients.iter().filter_map(|client| client.0.address()).collect(),
        };
        let server = |option: Option<Endpoint>, key: Option<Endpoint>, default| {
            option.or(key).unwrap_or(Endpoint::At(default)).address()
        };
        let links = Links {
            client_bind: self.bind.or(file.bind).unwrap_or_else(|| bind_for(&clients)),
            udp_server: server(
                self.udp_server,
                file.udp_server,
                instance.local(UDP_SERVER_PORT, 1),
            ),
            tcp_server: server(
                self.tcp_server,
                file.tcp_server,
                instance.local(TCP_SERVER.0, TCP_SERVER.1),
            ),
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
