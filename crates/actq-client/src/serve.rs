//! A controller as a simulator's policy: the pipe protocol ([`actq_link::pipe`]) on one side, the link on the other.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use actq_link::{NO_ACTION, RESET, STEP};
use anyhow::{Context as _, Result, bail};

use crate::client::{Client, require_armed};
use crate::event::Event;

/// Time without an action before an observation is sent again.
const REPEAT: Duration = Duration::from_millis(200);
/// Attempts before a step is answered without an action.
const ATTEMPTS: usize = 5;

/// Answers the simulator until its requests end. The controller's image receives every observation. With `arm` the
/// outputs follow its actions, and the answers are the outputs' targets. A reset disarms, which resets the head. So does
/// the end of the requests, and an error of the simulator; after a fault the controller keeps its safe action.
///
/// # Errors
///
/// Fails if the controller is lost, cannot be armed or stopped for a fault, or if the simulator violates the protocol.
pub fn serve(client: &mut Client, arm: bool, mut input: impl Read, mut output: impl Write) -> Result<()> {
    let status = client.status()?;
    let mut bytes = vec![0; 4 * usize::from(status.observation)];
    let no_action = vec![NO_ACTION; usize::from(status.axes)];
    let mut armed = false;
    loop {
        match request(&mut input, &mut bytes) {
            Ok(Request::End) => return client.disarm(),
            Ok(Request::Reset) => {
                client.disarm()?;
                armed = false;
            }
            Ok(Request::Step) => {
                let (values, _) = bytes.as_chunks();
                let observation: Vec<f32> = values.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
                if arm && !armed {
                    step(client, &observation, false)?;
                    client.arm()?;
                    armed = true;
                }
                let action = step(client, &observation, armed)?.unwrap_or_else(|| no_action.clone());
                let action: Vec<u8> = action.iter().flat_map(|value| value.to_le_bytes()).collect();
                if let Err(error) = output.write_all(&action).and_then(|()| output.flush()) {
                    client.disarm()?;
                    return Err(error).context("cannot write the output");
                }
            }
            Err(error) => {
                client.disarm()?;
                return Err(error);
            }
        }
    }
}

/// A simulator's request.
enum Request {
    Reset,
    /// With an observation.
    Step,
    /// The input has ended.
    End,
}

/// Reads a request, and the observation of a step into `bytes`.
fn request(input: &mut impl Read, bytes: &mut [u8]) -> Result<Request> {
    let mut command = [0];
    match input.read_exact(&mut command) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(Request::End),
        other => other.context("cannot read the input")?,
    }
    match command {
        [RESET] => Ok(Request::Reset),
        [STEP] => {
            let len = bytes.len();
            input.read_exact(bytes).with_context(|| format!("the input ended inside an observation of {len} bytes"))?;
            Ok(Request::Step)
        }
        [other] => bail!("unknown command byte 0x{other:02x}; R resets, S steps"),
    }
}

/// Returns the action for an observation; `None` without one. An attempt counts only if the controller answers a later
/// request, so a late controller is waited for.
fn step(client: &mut Client, observation: &[f32], armed: bool) -> Result<Option<Vec<f32>>> {
    let mut numbers = Vec::new();
    for _ in 0..ATTEMPTS {
        numbers.push(client.observe(observation)?);
        let mut action = listen(client, REPEAT, &numbers, armed)?;
        if action.is_none() {
            let status = client.status()?;
            if armed {
                require_armed(&status)?;
            }
            // It may have sent the action before the status.
            action = listen(client, Duration::ZERO, &numbers, armed)?;
        }
        if action.is_some() {
            return Ok(action);
        }
    }
    Ok(None)
}

/// Waits at most `wait` for the action for an observation with one of these numbers.
fn listen(client: &mut Client, wait: Duration, numbers: &[u32], armed: bool) -> Result<Option<Vec<f32>>> {
    let begun = Instant::now();
    loop {
        for event in client.events()? {
            match event {
                Event::Action { of, applied, values, .. } if numbers.contains(&of) && applied == armed => {
                    return Ok(Some(values));
                }
                Event::Status(status) if armed => require_armed(&status)?,
                _ => {}
            }
        }
        if begun.elapsed() >= wait {
            return Ok(None);
        }
    }
}
