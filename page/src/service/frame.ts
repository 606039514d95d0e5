/** Frames of `GET /v1/picture`: columns that become typed arrays without parsing. */

export type Column = Float64Array | Float32Array | Int32Array | Int8Array;

interface Described {
  rows: number;
  columns: Record<string, [string, number]>;
}

interface Header {
  data_time_s: number | null;
  next: number;
  skipped: number;
  /** Live tracks, of which the frame may have a part. */
  total: number;
  /** Tracks that have a trajectory set; of live frames. */
  bundles?: number[];
  sensors: string[];
  states: string[];
  /** First and last time of which there are pictures; null before there are any. */
  span_s: [number, number] | null;
  /** The time of a past picture. */
  at_s?: number;
  /** Whether it is of a recorded run, and the names of all. */
  recorded?: boolean;
  layers?: string[];
  /** Where its tracks are, degrees: west, south, east, north. */
  extent_deg?: [number, number, number, number] | null;
  tables: Record<string, Described>;
}

export class Table {
  constructor(
    readonly rows: number,
    private readonly columns: Map<string, Column>,
  ) {}

  /** Return a column; of a table without rows, an empty one. */
  column(name: string): Column {
    return this.columns.get(name) ?? new Float64Array(0);
  }
}

export interface Frame {
  header: Header;
  tracks: Table;
  plots: Table;
  /** Only of frames that have any. */
  bearings?: Table;
  /** Of past pictures: earlier positions of the tracks. */
  path: Table;
  /** Of runs without plots: when each sensor updated each track last. */
  heard?: Table;
}

const MAGIC = 0x3150524d;
const START = 8;

/** Decode a frame. @throws Error for anything that is none. */
export function decode(buffer: ArrayBuffer): Frame {
  const view = new DataView(buffer);
  if (buffer.byteLength < START || view.getUint32(0, true) !== MAGIC) {
    throw new Error("The response is not an air picture: the service may have a different version. Reload this page.");
  }
  const length = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, START, length))) as Header;
  const begin = START + length;
  return {
    header,
    tracks: table(buffer, begin, header.tables["tracks"]),
    plots: table(buffer, begin, header.tables["plots"]),
    bearings: table(buffer, begin, header.tables["bearings"]),
    path: table(buffer, begin, header.tables["path"]),
    heard: table(buffer, begin, header.tables["heard"]),
  };
}

function table(buffer: ArrayBuffer, begin: number, described: Described | undefined): Table {
  const columns = new Map<string, Column>();
  if (described === undefined) return new Table(0, columns);
  for (const [name, [kind, offset]] of Object.entries(described.columns)) {
    columns.set(name, typed(buffer, kind, begin + offset, described.rows));
  }
  return new Table(described.rows, columns);
}

function typed(buffer: ArrayBuffer, kind: string, offset: number, rows: number): Column {
  switch (kind) {
    case "f8":
      return new Float64Array(buffer, offset, rows);
    case "f4":
      return new Float32Array(buffer, offset, rows);
    case "i4":
      return new Int32Array(buffer, offset, rows);
    case "i1":
      return new Int8Array(buffer, offset, rows);
    default:
      throw new Error(`column type: expected f8, f4, i4 or i1, was ${kind}`);
  }
}
