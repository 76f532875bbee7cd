/** A number of the scenario that moves with a slider: its byte, and offset + slope value. */
export type Moved = [at: number, offset: number, slope: number];

export interface Slider {
  name: string;
  unit: string;
  text: string;
  value: number;
  low: number;
  high: number;
  moved: Moved[];
}

export interface Output {
  name: string;
  unit: string;
}

/** What `bristle export --web` writes as scenario.json. */
export interface Description {
  title: string;
  /** Rows behind the first, substeps of each, a substep [s]. */
  rows: number;
  substeps: number;
  h: number;
  outputs: Output[];
  sliders: Slider[];
  /** Output to the one that holds its measured values. */
  measured: Record<string, string>;
  /** First byte and number of items of each array. */
  places: Record<string, [begin: number, count: number]>;
  /** The numbers, base64. */
  numbers: string;
}

export class Scenario {
  static load(wasm: BufferSource, description: Description): Promise<Scenario>;
  readonly description: Description;
  readonly sliders: Slider[];
  /** Runs the scenario with values of sliders by name, in their units. */
  run(changes?: Record<string, number>): Run;
}

export class Run {
  readonly outputs: Output[];
  /** Rows that were computed; all of them where `complete`. */
  readonly rows: number;
  /** Time between two rows [s]. */
  readonly step: number;
  readonly complete: boolean;
  /** Times [s]. */
  readonly time: Float64Array;
  column(name: string): Float64Array;
  figures(name: string): { peak: number; rms: number };
}

export function bytesOf(base64: string): Uint8Array;
