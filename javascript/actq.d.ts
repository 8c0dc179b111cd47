/** A raw input of an image, or targets that it gives. */
export interface Port {
  readonly kind: "input" | "position" | "velocity" | "torque";
  readonly name: string;
  /** Names of the values, as those of joints; empty if they have none. */
  readonly names: readonly string[];
  readonly length: number;
  /** Lowest and highest value that a step accepts. */
  readonly range: readonly [number, number];
}

/** Compiles the module from its gzip file, `actq.wasm.gz`. */
export function compile(gzip: BufferSource): Promise<WebAssembly.Module>;

/** An image that runs, with its state. Each has a memory of its own, freed with it. */
export class Head {
  private constructor();
  /**
   * Opens an image, the content of an `.actq` file, and checks it.
   *
   * @param module A compiled module; by default, the file `actq.wasm.gz` beside this one.
   * @throws If the content is no image of this version, or damaged.
   */
  static open(content: BufferSource, module?: WebAssembly.Module): Promise<Head>;
  /** Name of the policy. */
  readonly name: string;
  /** Values of an observation. */
  readonly observationLength: number;
  /** Values of an action. */
  readonly actionLength: number;
  /** Control rate in Hz. */
  readonly rateHz: number;
  /** Bytes of scratch memory that a microcontroller needs. */
  readonly scratchBytes: number;
  /** CRC-32 of the image, as in its header. */
  readonly crc32: number;
  /** Bytes of a saved state. */
  readonly stateBytes: number;
  /** Raw inputs in the order of the observation; empty without a description. */
  readonly inputs: readonly Port[];
  /** Targets in the order of the action; empty without a description. */
  readonly targets: readonly Port[];
  /**
   * Returns the action for an observation, in f32 with the bits of a microcontroller.
   *
   * @throws If the observation has another length, or a value that is not finite or out of its range; if a value inside the
   *   network exceeds f32's range. An error of the values resets the recurrent state, as on a microcontroller.
   */
  step(observation: ArrayLike<number>): Float32Array;
  /** Clears the recurrent state, histories, chunks and the last action. */
  reset(): void;
  /** Sets the seed of a flow or diffusion policy's noise, 0 by default, and resets. */
  seed(seed: number): void;
  /** Returns the state between two steps: recurrent state, histories, chunks, last action, and the noise's position. */
  save(): Uint8Array;
  /**
   * Continues from a state that a head of the same image saved: the next actions have the same bits.
   *
   * @throws If the state is of another image, or damaged; the head keeps its own.
   */
  restore(state: Uint8Array): void;
  /**
   * Computes with these weights in f32 from now on, in place of the image's own: each matrix once, in the order of the
   * operations that first use them, row by row.
   */
  useWeights(weights: Float32Array): void;
}
