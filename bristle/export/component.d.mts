export interface Variable {
  name: string;
  reference: number;
  kind: "Real" | "Integer" | "Boolean" | "String";
  causality: string;
  unit: string;
  start: number | boolean | string | null;
  text: string;
}

/** What `bristle export --web` writes as component.json. */
export interface Description {
  name: string;
  guid: string;
  text: string;
  variables: Variable[];
}

export class Component {
  static load(wasm: BufferSource, description: Description): Promise<Component>;
  readonly description: Description;
  /** Where the component stands [s]. */
  readonly time: number;
  /** What the component has said so far: warnings, and why it stopped. */
  readonly messages: string[];
  /** Sets inputs, or before the first step parameters, by name. */
  set(values: Record<string, number | boolean | string>): void;
  /** Returns the value of a variable by name, in its unit. */
  get(name: string): number | boolean;
  /** Steps over `dt` seconds; throws what the component says if it cannot. */
  step(dt: number): void;
  /** Goes back to the start, all values as the component declares them. */
  reset(): void;
}
