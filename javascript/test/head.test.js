// The package against images and golden runs of the repository.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import test from "node:test";

import { Head } from "../actq.js";

const file = (path) => readFile(new URL(path, import.meta.url));
const valid = await file("../../kernels/tests/valid.actq");

test("an image gives its properties and actions", async () => {
  const head = await Head.open(valid);
  assert.ok(head.name.length > 0 && head.rateHz > 0 && head.scratchBytes > 0);
  const observation = new Float32Array(head.observationLength).fill(0.25);
  const first = head.step(observation);
  assert.equal(first.length, head.actionLength);
  assert.ok(first.every(Number.isFinite));
  head.reset();
  assert.deepEqual(head.step(observation), first);
});

test("an image may be an ArrayBuffer or a part of one", async () => {
  const whole = new Uint8Array(valid.length + 8);
  whole.set(valid, 4);
  const part = whole.subarray(4, 4 + valid.length);
  const { crc32 } = await Head.open(valid);
  for (const content of [part, new DataView(whole.buffer, 4, valid.length), part.slice().buffer]) assert.equal((await Head.open(content)).crc32, crc32);
  for (const content of ["ur3.actq", [...valid], undefined]) await assert.rejects(Head.open(content), /pass a Uint8Array or an ArrayBuffer/);
});

test("heads are independent", async () => {
  const [a, b] = await Promise.all([Head.open(valid), Head.open(valid)]);
  const observation = new Float32Array(a.observationLength).fill(0.5);
  a.step(observation);
  a.step(observation);
  const fresh = await Head.open(valid);
  assert.deepEqual(b.step(observation), fresh.step(observation));
});

test("a restored state continues with the same actions", async () => {
  const head = await Head.open(await file("../../kernels/tests/valid.actq"));
  const observation = new Float32Array(head.observationLength).fill(0.25);
  const fresh = head.step(observation);
  const state = head.save();
  assert.equal(state.length, head.stateBytes);
  const [second, third] = [head.step(observation), head.step(observation)];
  head.restore(state);
  assert.deepEqual([head.step(observation), head.step(observation)], [second, third]);
  // Another head of the image, too; a damaged state changes nothing.
  const other = await Head.open(valid);
  other.restore(state);
  const damaged = Uint8Array.from(state);
  damaged[damaged.length - 1] ^= 1;
  assert.throws(() => other.restore(damaged), /damaged/i);
  assert.throws(() => other.restore(state.subarray(4)), /bytes|length/i);
  assert.deepEqual(other.step(observation), second);
  other.reset();
  assert.deepEqual(other.step(observation), fresh);
});

test("wrong bytes, lengths and values are refused", async () => {
  await assert.rejects(Head.open(new Uint8Array(64)), /image|magic|actq/i);
  const damaged = Uint8Array.from(valid);
  damaged[damaged.length >> 1] ^= 1;
  await assert.rejects(Head.open(damaged), /checksum|damaged|crc/i);
  const head = await Head.open(valid);
  assert.throws(() => head.step([0]), /the image needs/);
  const observation = new Float32Array(head.observationLength);
  observation[0] = NaN;
  assert.throws(() => head.step(observation), /finite/);
  assert.throws(() => head.useWeights(new Float32Array(1)), /weights/);
});
