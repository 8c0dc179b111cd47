//! A controller's port: a serial port, or a socket, such as an emulator's serial port.

use std::fmt;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::str::FromStr;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};

/// Default bits per second of a serial port.
const BAUD: u32 = 921_600;

/// A byte stream to a controller. A read waits at most [`READ_TIMEOUT`].
pub trait Port: Read + Write + Send {}

impl<P: Read + Write + Send> Port for P {}

/// Longest time that a read waits for a first byte.
pub const READ_TIMEOUT: Duration = Duration::from_millis(2);

/// Longest time that a write may take.
const WRITE_TIMEOUT: Duration = Duration::from_secs(2);

/// Address of a controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A serial port: its name and bits per second.
    Serial(String, u32),
    /// A TCP socket: host and port.
    Tcp(String),
    /// A Unix domain socket: its path.
    Unix(String),
}

/// Parses `NAME`, `NAME@BAUD`, `tcp:HOST:PORT` or `unix:PATH`.
impl FromStr for Address {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        if let Some(address) = text.strip_prefix("tcp:") {
            let has_port =
                address.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
            return if has_port { Ok(Self::Tcp(address.to_owned())) } else { bail!("the form is tcp:HOST:PORT") };
        }
        if let Some(path) = text.strip_prefix("unix:") {
            return if path.is_empty() { bail!("the form is unix:PATH") } else { Ok(Self::Unix(path.to_owned())) };
        }
        let (name, baud) = match text.rsplit_once('@') {
            Some((name, baud)) => (name, baud.parse().ok().filter(|baud| *baud > 0).context("the form is NAME@BAUD")?),
            None => (text, BAUD),
        };
        if name.is_empty() { bail!("the port's name is empty") } else { Ok(Self::Serial(name.to_owned(), baud)) }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(name, baud) => write!(f, "{name}@{baud}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Unix(path) => write!(f, "unix:{path}"),
        }
    }
}

impl Address {
    /// Opens the port.
    ///
    /// # Errors
    ///
    /// Fails if the port does not exist or may not be opened.
    pub fn open(&self) -> io::Result<Box<dyn Port>> {
        match self {
            Self::Serial(name, baud) => {
                let port = serialport::new(name, *baud).timeout(READ_TIMEOUT).open();
                let explained = |error| {
                    let error = io::Error::from(error);
                    io::Error::new(error.kind(), format!("{error}; `actq link ports` lists the ports"))
                };
                Ok(Box::new(port.map_err(explained)?))
            }
            Self::Tcp(address) => {
                let stream = TcpStream::connect(address)?;
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(READ_TIMEOUT))?;
                stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
                Ok(Box::new(stream))
            }
            Self::Unix(path) => unix(path),
        }
    }
}

#[cfg(unix)]
fn unix(path: &str) -> io::Result<Box<dyn Port>> {
    let stream = std::os::unix::net::UnixStream::connect(path)?;
    stream.set_read_timeout(Some(READ_TIMEOUT))?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    Ok(Box::new(stream))
}

#[cfg(not(unix))]
fn unix(_: &str) -> io::Result<Box<dyn Port>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "this system has no Unix domain sockets; use tcp:HOST:PORT"))
}

/// Lists this machine's serial ports, each with a description.
///
/// # Errors
///
/// Fails if the system cannot list them.
pub fn list() -> Result<Vec<(String, String)>> {
    let about = |kind: serialport::SerialPortType| match kind {
        serialport::SerialPortType::UsbPort(usb) => {
            let names = [usb.manufacturer, usb.product, usb.serial_number];
            let names: Vec<String> = names.into_iter().flatten().collect();
            format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, names.join(" "))
        }
        serialport::SerialPortType::PciPort => "PCI".to_owned(),
        serialport::SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        serialport::SerialPortType::Unknown => String::new(),
    };
    let ports = serialport::available_ports().context("the system cannot list its serial ports")?;
    Ok(ports.into_iter().map(|port| (port.port_name, about(port.port_type))).collect())
}
