#![expect(clippy::disallowed_methods, reason = "ground stations for the tests")]

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::task::Context;
use std::thread::{self, JoinHandle};

use super::sockets::TcpServer;
use super::*;
use crate::config;
use crate::io::plant_link::{ControlChannels, channels};
use aircraft::DEFAULT_MODEL;
use mavlink_services::peers::CONNECTIONS_MAX;
use tokio::runtime::{Builder, Runtime};

const TIMEOUT: Duration = Duration::from_secs(10);

fn loopback() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}

fn config(clients: &[SocketAddr]) -> GcsConfig {
    GcsConfig {
        links: Links {
            clients: clients.to_vec(),
            client_bind: loopback(),
            udp_server: Some(loopback()),
            tcp_server: Some(loopback()),
        },
        parameters: Parameters::default(),
        model: config::aircraft_model("model", DEFAULT_MODEL).unwrap(),
        defaults: Parameters::default(),
        identity: HeartbeatIdentity::default(),
        script: None,
        kept: None,
        kept_plan: None,
        kept_key: None,
        logs: None,
    }
}

fn runtime() -> Runtime {
    Builder::new_current_thread().enable_all().build().unwrap()
}

/// A link that serves on its own thread, and the channels that keep it alive.
struct Served {
    listening: Listening,
    thread: JoinHandle<Result<(), ControlEnded>>,
    stop: watch::Sender<bool>,
    _control: ControlChannels,
}

fn serve(clients: &[SocketAddr]) -> Served {
    let runtime = runtime();
    let link = runtime.block_on(GcsLink::open(&config(clients))).unwrap();
    let listening = link.listening().clone();
    let (ground, control) = channels();
    let (stop, stopped) = watch::channel(false);
    let thread = thread::spawn(move || runtime.block_on(link.run(ground, stopped)));
    Served { listening, thread, stop, _control: control }
}

impl Served {
    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.listening.tcp_server.unwrap()).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        stream.set_nodelay(true).unwrap();
        stream
    }
}

fn station() -> UdpSocket {
    let station = UdpSocket::bind(loopback()).unwrap();
    station.set_read_timeout(Some(TIMEOUT)).unwrap();
    station
}

/// PING to all systems; the answers repeat `number`.
fn ping(number: u32) -> Vec<u8> {
    let mut frame = vec![0xFD, 14, 0, 0, 0, 255, 190, 4, 0, 0];
    frame.extend_from_slice(&[0; 8]);
    frame.extend_from_slice(&number.to_le_bytes());
    frame.extend_from_slice(&[0, 0]);
    let crc = ::mavlink::calculate_crc(&frame[1..], 237);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

/// Reads frames until `wanted` pings were answered; returns their numbers.
fn answers(stream: &mut TcpStream, wanted: usize) -> Vec<u32> {
    let mut numbers = Vec::new();
    while numbers.len() < wanted {
        let mut header = [0; 10];
        stream.read_exact(&mut header).unwrap();
        assert_eq!(header[0], 0xFD);
        let mut rest = vec![0; usize::from(header[1]) + 2];
        stream.read_exact(&mut rest).unwrap();
        if header[7..10] == [4, 0, 0] {
            numbers.push(u32::from_le_bytes(rest[8..12].try_into().unwrap()));
        }
    }
    numbers
}

#[test]
fn a_heartbeat_reaches_the_configured_ground_station_and_shutdown_ends_the_link() {
    let station = station();
    let served = serve(&[station.local_addr().unwrap()]);
    let mut buffer = [0; 300];
    let (length, _) = station.recv_from(&mut buffer).unwrap();
    assert_eq!((length, buffer[0], buffer[7]), (21, 0xFD, 0), "a HEARTBEAT of MAVLink 2");
    served.stop.send(true).unwrap();
    assert!(served.thread.join().unwrap().is_ok());
}

#[test]
fn an_address_in_use_names_process_link_option_and_address() {
    let served = serve(&[]);
    let Listening { udp_server, tcp_server, .. } = served.listening;
    let base = config(&[]);
    let udp = Links { udp_server, ..base.links.clone() };
    let tcp = Links { tcp_server, ..base.links.clone() };
    let client_bind = udp_server.unwrap();
    let client = Links { clients: vec![loopback()], client_bind, ..base.links.clone() };
    for (links, address, link, option) in [
        (udp, udp_server, "UDP port", "--gcs-udp-server"),
        (tcp, tcp_server, "TCP port", "--gcs-tcp"),
        (client, udp_server, "UDP socket", "--gcs-bind"),
    ] {
        let config = GcsConfig { links, ..base.clone() };
        let error = runtime().block_on(GcsLink::open(&config)).unwrap_err().to_string();
        for part in ["autopilot", link, option, &address.unwrap().to_string(), "in use"] {
            assert!(error.contains(part), "{part} is missing: {error}");
        }
    }
}

#[test]
fn too_many_ground_stations_to_call_are_refused_with_the_limit() {
    let config = config(&[loopback(); CONFIGURED_MAX + 1]);
    let error = runtime().block_on(GcsLink::open(&config)).unwrap_err().to_string();
    assert!(error.contains("9 ground stations") && error.contains("at most 8"), "{error}");
}

#[test]
fn the_link_ends_with_the_control_thread() {
    let runtime = runtime();
    let link = runtime.block_on(GcsLink::open(&config(&[]))).unwrap();
    let (ground, control) = channels();
    let (_stop, stopped) = watch::channel(false);
    drop(control);
    let result = runtime.block_on(link.run(ground, stopped));
    assert!(matches!(result, Err(ControlEnded)), "{result:?}");
}

#[test]
fn whoever_calls_the_udp_port_is_answered_from_there() {
    let served = serve(&[]);
    let port = served.listening.udp_server.unwrap();
    let station = station();
    station.send_to(&ping(7), port).unwrap();
    let mut buffer = [0; 300];
    let (_, from) = station.recv_from(&mut buffer).unwrap();
    assert_eq!(from, port);
}

#[test]
fn tcp_frames_cut_anywhere_are_answered_in_order() {
    let served = serve(&[]);
    let mut station = served.connect();
    let stream: Vec<u8> = (0..200).flat_map(ping).collect();
    for part in stream.chunks(7) {
        station.write_all(part).unwrap();
    }
    assert_eq!(answers(&mut station, 200), (0..200).collect::<Vec<u32>>());
}

#[test]
fn connections_that_say_nothing_keep_nobody_out() {
    let served = serve(&[]);
    let silent: Vec<TcpStream> = (0..CONNECTIONS_MAX).map(|_| served.connect()).collect();
    let mut stations = Vec::new();
    for number in 0..CONNECTIONS_MAX as u32 {
        let mut station = served.connect();
        station.write_all(&ping(number)).unwrap();
        assert_eq!(answers(&mut station, 1), [number]);
        stations.push(station);
    }
    drop(silent);
}

#[test]
fn a_connection_that_reads_nothing_is_read_no_further_and_delays_no_other() {
    let served = serve(&[]);
    let mut slow = served.connect();
    slow.set_write_timeout(Some(Duration::from_millis(500))).unwrap();
    // Until neither the system nor the link accepts more.
    let mut sent = 0;
    let error = loop {
        match slow.write(&ping(sent)) {
            Ok(_) => sent += 1,
            Err(error) => break error,
        }
        assert!(sent < 2_000_000, "its input is read without end");
    };
    assert!(matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{error}");
    let mut other = served.connect();
    other.write_all(&ping(5)).unwrap();
    assert_eq!(answers(&mut other, 1), [5], "the others are served meanwhile");
    // No accepted byte is lost: the last whole frame is answered as well.
    let taken: Vec<u32> = answers(&mut slow, 10_000);
    assert_eq!(taken, (0..10_000).collect::<Vec<u32>>());
}

#[test]
fn a_connection_that_takes_nothing_for_a_minute_is_given_up_and_one_that_takes_a_little_is_not() {
    runtime().block_on(async {
        let mut server = TcpServer::open(loopback()).unwrap();
        let mut station = TcpStream::connect(server.local_address().unwrap()).unwrap();
        station.set_read_timeout(Some(TIMEOUT)).unwrap();
        let connection = Connection(0);
        let mut now = WallTime::ZERO;
        // Fills the system's buffer; true if it accepted any.
        let fill = async |server: &mut TcpServer, now: WallTime| {
            let mut took = false;
            let poll = |cx: &mut Context<'_>, server: &mut TcpServer| {
                server.poll(cx, &mut [0; 16], &|_| false, now)
            };
            let timeout = Duration::from_millis(200);
            while tokio::time::timeout(timeout, poll_fn(|cx| poll(cx, server))).await.is_ok() {
                took = true;
                while server.can_send(connection) {
                    server.send(connection, vec![0; 4_096], now);
                }
            }
            took
        };
        assert!(fill(&mut server, now).await);
        assert!(!server.can_send(connection), "the system takes no more");
        assert_eq!(server.stalled(now + Duration::from_secs(60)), None);
        assert_eq!(server.stalled(now + Duration::from_secs(61)), Some(connection));
        // Whatever the peer accepts restarts the time limit.
        now = now + Duration::from_secs(50);
        let mut buffer = vec![0; 1 << 20];
        station.read_exact(&mut buffer[..30_000]).unwrap();
        while !fill(&mut server, now).await {
            station.read_exact(&mut buffer[..30_000]).unwrap();
        }
        assert_eq!(server.stalled(now + Duration::from_secs(60)), None);
        assert_eq!(server.stalled(now + Duration::from_secs(61)), Some(connection));
    });
}
