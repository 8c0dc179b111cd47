//! `actq serve`: the pipe protocol as a simulator uses it.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::Stdio;

use actq::data::arrays;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::command::{actq, all, failed, run, succeeded};
use actq_bench::qemu::step_request;
use actq_bench::ur3_flow;
use actq_link::{RESET, STEP};
use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::fixture::{ACT, Fixture, OBS, description, draw_observations, edit, floats, text};

#[test]
fn serve_plays_a_chunk_then_plans_again() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("--bits 4")?;
    let obs: Vec<Vec<f32>> = draw_observations(9, OBS).rows().into_iter().take(6).map(|row| row.to_vec()).collect();
    let json = description();
    let action = |raw: &[f32], position: usize| -> Vec<f32> {
        let at = |name: &str, i: usize| json["action"][name][i].as_f64().unwrap_or(f64::NAN) as f32;
        let scaled = (0..ACT).map(|i| raw[position * ACT + i] * at("scale", i) + at("offset", i));
        scaled.enumerate().map(|(i, a)| a.clamp(at("low", i), at("high", i))).collect()
    };
    let buffer = ImageBuffer::read(&path)?;
    let raw = with_head(buffer.image(&path)?, |head| {
        obs.iter().map(|obs| Ok(head.infer(obs)?.to_vec())).collect::<Result<Vec<_>>>()
    })?;
    // Observation, and the plan and position of the answer; None resets. The policy has no recurrent state.
    let session = [
        Some((0, 0, 0)),
        Some((1, 0, 1)),
        Some((2, 2, 0)),
        None,
        Some((3, 3, 0)),
        Some((4, 3, 1)),
        Some((5, 5, 0)),
        None,
    ];

    // Like a simulator: read every answer before the next request.
    let mut child = actq(&["serve", &text(&path)]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut stdin = child.stdin.take().context("the command has no standard input")?;
    let mut stdout = child.stdout.take().context("the command has no standard output")?;
    let mut answers = Vec::new();
    for part in session {
        let Some((seen, plan, position)) = part else {
            stdin.write_all(&[RESET])?;
            continue;
        };
        stdin.write_all(&step_request(&obs[seen]))?;
        let mut answer = vec![0; 4 * ACT];
        stdout.read_exact(&mut answer)?;
        assert_eq!(answer, floats(&action(&raw[plan], position)), "observation {seen}");
        answers.extend(answer);
    }
    drop(stdin);
    let mut rest = Vec::new();
    stdout.read_to_end(&mut rest)?;
    ensure!(rest.is_empty(), "{} unexpected bytes", rest.len());
    ensure!(child.wait()?.code() == Some(0), "the end of the input must not be an error");

    // The same requests at once.
    let requests = session.map(|part| part.map_or(vec![RESET], |(seen, ..)| step_request(&obs[seen]))).concat();
    let output = run(actq(&["serve", &text(&path)]), &requests)?;
    assert_eq!((output.status.code(), output.stdout), (Some(0), answers));
    Ok(())
}

#[test]
fn serve_refuses_malformed_requests() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = text(&fixture.image("")?);
    let good = step_request(&[0.5; OBS]);
    let cases: [(&str, Vec<u8>, usize, &[&str]); 4] = [
        ("unknown byte", vec![RESET, b'X'], 0, &["0x58"]),
        ("end inside an observation", good[..good.len() - 1].to_vec(), 0, &["observation"]),
        ("end after S", [&good[..], &[STEP]].concat(), 1, &["observation"]),
        ("text", [&good[..], &good[..], b"\n"].concat(), 2, &["0x0a"]),
    ];
    all(cases.map(|(what, input, answers, words)| {
        let result = run(actq(&["serve", &path]), &input).and_then(|output| {
            ensure!(output.stdout.len() == answers * 4 * ACT, "{} bytes of answers", output.stdout.len());
            failed(&output, 1, words)
        });
        (what.to_owned(), result)
    }))
}

#[test]
fn serve_answers_non_finite_values_without_an_action() -> Result<()> {
    let fixture = Fixture::new()?;
    // Nothing bounds the network's values.
    edit(&fixture.policy(), "/ops/0/clip", Value::Null)?;
    let path = text(&fixture.image("--bits 4")?);
    let serve = |frames: &[&[u8]]| -> Result<Vec<Vec<u8>>> {
        let output = run(actq(&["serve", &path]), &frames.concat())?;
        ensure!(output.status.code() == Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        Ok(output.stdout.chunks(4 * ACT).map(<[u8]>::to_vec).collect())
    };
    let observations = draw_observations(9, OBS);
    let rows: Vec<Vec<u8>> = observations.rows().into_iter().take(3).map(|row| step_request(&row.to_vec())).collect();
    let mut one_nan = [0.25; OBS];
    one_nan[OBS - 1] = f32::NAN;
    // The end of a chunk, and the middle of one.
    let expected = serve(&[&rows[0], &rows[0], b"R", &rows[1], b"R", &rows[2]])?;
    let no_action = 0x7fc0_0000u32.to_le_bytes().repeat(ACT);
    for (what, bad) in [
        ("NaN", step_request(&one_nan)),
        ("infinity", step_request(&[f32::NEG_INFINITY; OBS])),
        ("overflow inside", step_request(&[f32::MAX; OBS])),
    ] {
        // After it the policy plans anew, as after a reset.
        let answers = serve(&[&rows[0], &rows[0], &bad, &rows[1], &step_request(&one_nan), &rows[2]])?;
        let right = [&expected[0], &expected[1], &no_action, &expected[2], &no_action, &expected[3]];
        ensure!(answers.iter().eq(right), "{what}: {answers:02x?}");
    }
    Ok(())
}

/// The recording of a flow has no noise, so it has no actions either: a reader draws noise, and labels it.
#[test]
fn a_flow_is_recorded_without_actions() -> Result<()> {
    let fixture = Fixture::new()?;
    let (policy, image, recording) = (text(&ur3_flow()), fixture.out("flow.actq"), fixture.out("drive.npz"));
    let [image, recording] = [image, recording].map(|path| text(&path));
    succeeded(&run(actq(&["quantize", &policy, "--method", "rtn", "--bits", "4", "--out", &image]), b"")?)?;
    let observations = draw_observations(9, 18);
    let requests: Vec<Vec<u8>> = observations.rows().into_iter().map(|row| step_request(&row.to_vec())).collect();
    let serve = ["serve", &image, "--policy", &policy, "--record", &recording];
    let output = run(actq(&serve), &requests.concat())?;
    ensure!(output.status.code() == Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    ensure!(output.stdout.len() == requests.len() * 4 * 6, "{} bytes of answers", output.stdout.len());
    let recorded = arrays(Path::new(&recording))?;
    ensure!(recorded["obs"].shape.iter().product::<usize>() == observations.len() && !recorded.contains_key("action"));
    let eval = ["eval", &image, "--policy", &policy, "--driven", &recording];
    ensure!(succeeded(&run(actq(&eval), b"")?)?.contains("own path"));
    Ok(())
}

#[test]
fn a_policy_without_a_recording_is_refused() -> Result<()> {
    let fixture = Fixture::new()?;
    let (image, policy) = (text(&fixture.image("")?), text(&fixture.policy()));
    failed(&run(actq(&["serve", &image, "--policy", &policy]), b"")?, 1, &["--policy", "--record FILE.npz"])?;
    // Every command of a rollout has it in its environment.
    let mut command = actq(&["serve", &image]);
    command.env("ACTQ_POLICY", &policy);
    succeeded(&run(command, b"")?).map(drop)
}
