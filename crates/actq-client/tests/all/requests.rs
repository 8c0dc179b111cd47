//! Requests over a good and a faulty line.

use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::event::Event;
use actq_client::port::Address;
use actq_controller::Output;
use actq_controller::slots::Anyone;
use actq_link::code::{Crash, Fault, Parameter, Refusal, ResetCause, State};
use actq_link::report::{BUILT_IN, Counters, Status};
use actq_link::{Message, Receiver, Sender, frame};

use crate::simulated::{OBSERVATION, Simulated};

/// Sends observations until the controller can be armed.
pub(super) fn observe_until_fresh(client: &mut Client) {
    for _ in 0..1000 {
        for _ in 0..5 {
            client.observe(&[0.4; OBSERVATION]).expect("the observation fits");
        }
        if client.status().expect("the controller answers").refusal.is_none() {
            return;
        }
    }
    panic!("no observation gets through");
}

/// Arms over a line whose lost frames may make observations too old.
pub(super) fn arm(client: &mut Client) {
    for _ in 0..1000 {
        observe_until_fresh(client);
        if client.arm().is_ok() {
            return;
        }
    }
    panic!("it is never armed");
}

#[test]
fn a_faulty_line_loses_no_request() {
    for faults in [0, 100, 300] {
        let controller = Simulated::start(faults, || Anyone);
        let mut client = controller.client();
        let status = client.status().expect("the controller answers");
        assert_eq!((status.state, status.slot, status.axes), (State::Disarmed, BUILT_IN, 2));
        assert_eq!((usize::from(status.observation), status.image), (OBSERVATION, 0x1234));
        assert_eq!(client.timing().expect("the controller answers").period, 1_000_000);
        let breadcrumb = client.breadcrumb().expect("the controller answers");
        assert_eq!((breadcrumb.reset, breadcrumb.crash), (ResetCause::Watchdog, None));
        client.set(Parameter::High, 1, 0.5).expect("the limit is stricter");
        assert_eq!(client.get(Parameter::High, 1).expect("the parameter exists"), 0.5);
        let error = client.set(Parameter::High, 1, 1.5).expect_err("it is wider");
        assert!(format!("{error:#}").contains(&Refusal::Range.to_string()), "{error:#}");
        let error = client.get(Parameter::High, 2).expect_err("there are two axes");
        assert!(format!("{error:#}").contains(&Refusal::Parameter.to_string()), "{error:#}");
        arm(&mut client);
        client.disarm().expect("a disarm is never refused");
        assert_eq!(client.status().expect("the controller answers").state, State::Disarmed);
    }
}

#[test]
fn arming_without_observations_is_refused() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    let error = client.arm().expect_err("there are no observations");
    assert!(format!("{error:#}").contains(&Refusal::Stale.to_string()), "{error:#}");
}

/// As when a busy machine silences the line again and again.
#[test]
fn a_renewed_token_is_read_again() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    controller.control.renew.store(20, Ordering::Relaxed);
    client.set(Parameter::High, 1, 0.5).expect("it has the current token at last");
    assert_eq!(controller.control.renew.load(Ordering::Relaxed), 0);
}

#[test]
fn a_broken_cable_is_safe_and_reconnects() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    arm(&mut client);
    controller.control.cut.store(true, Ordering::Relaxed);
    // The host continues; the deadline passes, and the ramp ends at 0.
    controller.control.miss_the_deadline(|| {
        client.observe(&[1.0; OBSERVATION]).expect("the observation fits");
        client.events().expect("the client reopens the port");
    });
    assert!(controller.outputs().iter().all(|o| matches!(o, Output::Coast | Output::Drive(0.0))));
    controller.control.cut.store(false, Ordering::Relaxed);
    let status = client.status().expect("the controller answers again");
    assert_eq!((status.state, status.fault), (State::Latched, Some(Fault::Stale)));
    assert!(client.connection().reopened() >= 1);
    arm(&mut client);
}

#[test]
fn a_reset_controller_reports_its_reset() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    arm(&mut client);
    controller.control.reset.store(true, Ordering::Relaxed);
    while controller.control.starts.load(Ordering::Relaxed) < 2 {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(client.status().expect("the controller answers").state, State::Disarmed);
    let breadcrumb = client.breadcrumb().expect("the controller answers");
    assert_eq!((breadcrumb.crash, breadcrumb.pc, breadcrumb.count), (Some(Crash::Panic), 0x0800_0100, 1));
}

#[test]
fn a_missing_port_is_named() {
    let address: Address = "tcp:127.0.0.1:1".parse().expect("a valid address");
    let error = actq_client::connection::Connection::open(address, Duration::ZERO).err().expect("no program listens");
    assert!(format!("{error:#}").contains("tcp:127.0.0.1:1"), "{error:#}");
}

#[test]
fn addresses_parse_as_displayed() {
    for text in ["/dev/ttyUSB0@115200", "COM3@921600", "tcp:localhost:4000", "tcp:[::1]:4000", "unix:/tmp/uart"] {
        assert_eq!(text.parse::<Address>().expect(text).to_string(), text);
    }
    assert_eq!("COM3".parse::<Address>().expect("a name is enough").to_string(), "COM3@921600");
    for text in ["", "tcp:", "tcp:host", "tcp::4000", "tcp:host:70000", "unix:", "COM3@fast", "COM3@0"] {
        assert!(text.parse::<Address>().is_err(), "{text}");
    }
    actq_client::port::list().expect("the system lists its serial ports");
}

/// A controller in its place: answers each message, or not.
fn answering(
    answer: impl Fn(usize, u32, &Message<'_>) -> Option<Message<'static>> + Send + 'static,
) -> (Client, thread::JoinHandle<usize>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("an address").to_string();
    let controller = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("the client opens the port");
        let (mut receiver, mut sender, mut byte) = (Receiver::<{ frame::bytes(64) }>::new(), Sender::new(1), [0]);
        let mut armings = 0;
        while matches!(stream.read(&mut byte), Ok(1)) {
            let Some(received) = receiver.push(byte[0]) else { continue };
            armings += usize::from(matches!(received.message, Message::Arm { .. }));
            if let Some(answer) = answer(armings, received.sequence, &received.message) {
                stream.write_all(sender.frame(&answer, 0, &mut [0; 64]).expect("it fits")).expect("the client reads");
            }
        }
        armings
    });
    let hang = Duration::from_secs(600);
    let connection = Connection::open(Address::Tcp(address), hang).expect("the port is open");
    (Client::new(connection, hang), controller)
}

/// The controller was armed, its answer was lost, and an overrun latched: a repetition must not arm it again.
#[test]
fn stopped_controllers_are_not_armed_again() {
    let (mut client, controller) = answering(|armings, of, message| match message {
        Message::Ask(_) => Some(Message::Status(Status {
            state: if armings == 0 { State::Disarmed } else { State::Latched },
            fault: (armings > 0).then_some(Fault::Overrun),
            token: if armings == 0 { 1 } else { 2 },
            ..IDLE
        })),
        Message::Arm { token } if armings > 1 => {
            let refusal = (*token != 2).then_some(Refusal::Token);
            Some(Message::Ack { of, refusal, written: 0 })
        }
        _ => None,
    });
    let error = client.arm().expect_err("it stopped");
    let text = format!("{error:#}");
    assert!(text.contains("then arm it again") && text.contains(&Fault::Overrun.to_string()), "{text}");
    drop(client);
    assert_eq!(controller.join().expect("the controller ends"), 2);
}

/// Only the token changed, as on a line that was silent: the one request did not arm.
#[test]
fn old_tokens_are_replaced_by_new_ones() {
    let (mut client, controller) = answering(|armings, of, message| match message {
        Message::Ask(_) => Some(Message::Status(Status { token: 1 + armings as u32, ..IDLE })),
        Message::Arm { token } => {
            let refusal = (*token < 2).then_some(Refusal::Token);
            Some(Message::Ack { of, refusal, written: 0 })
        }
        _ => None,
    });
    client.arm().expect("the second request has the new token");
    drop(client);
    assert_eq!(controller.join().expect("the controller ends"), 2);
}

const IDLE: Status = Status {
    state: State::Disarmed,
    fault: None,
    refusal: None,
    reset: ResetCause::Power,
    token: 0,
    ticks: 0,
    image: 0,
    slot: BUILT_IN,
    axes: 1,
    observation: 1,
    payload: 64,
    refused: 0,
    counters: Counters { good: 0, damaged: 0, malformed: 0, repeated: 0, lost: 0 },
};

/// A controller that is late sends an answer and what follows it at once.
#[test]
fn events_after_an_answer_are_kept() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("an address").to_string();
    let controller = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("the client opens the port");
        let (mut receiver, mut byte) = (Receiver::<{ frame::bytes(64) }>::new(), [0]);
        let of = loop {
            stream.read_exact(&mut byte).expect("a request");
            if let Some(received) = receiver.push(byte[0]) {
                break received.sequence;
            }
        };
        let (mut sender, mut bytes) = (Sender::new(1), Vec::new());
        for of in [of, 1234] {
            let answer = Message::Ack { of, refusal: None, written: 0 };
            bytes.extend_from_slice(sender.frame(&answer, 0, &mut [0; 64]).expect("it fits"));
        }
        stream.write_all(&bytes).expect("the client reads");
        // Until the client closes the port.
        let _ = stream.read_to_end(&mut bytes);
    });
    let hang = Duration::from_secs(600);
    let connection = Connection::open(Address::Tcp(address), hang).expect("the port is open");
    let mut client = Client::new(connection, hang);
    client.disarm().expect("it is acknowledged");
    let mut events = Vec::new();
    while events.is_empty() {
        events.extend(client.events().expect("the port is open"));
    }
    assert!(matches!(events[..], [Event::Ack { of: 1234, .. }]), "{events:?}");
    drop(client);
    controller.join().expect("the controller ends");
}
