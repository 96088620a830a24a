/** The data of the page: facts of the study, and columns with exactly the values of the file. */

/**
 * @typedef {Object} Column
 * @property {string} name
 * @property {string} unit empty for bare numbers
 * @property {string} meaning
 * @property {string} role parameter, metric, margin or bookkeeping
 * @property {?Object<string, string>} labels of codes
 * @property {boolean} whole
 * @property {?[number, number]} ratio multiplier and divisor from the declared unit to the shown one; null for 1
 * @property {string} heading name in files
 * @property {Float64Array} declared the values of the file
 * @property {Float64Array} values in the shown unit
 */

/**
 * @typedef {Object} Model
 * @property {Object} study
 * @property {Column[]} columns
 * @property {Map<string, Column>} byName
 * @property {Float64Array} designs their numbers, ascending
 * @property {Uint8Array} kinds INFEASIBLE, FEASIBLE or FRONT
 * @property {number} size
 */

export const INFEASIBLE = 0,
  FEASIBLE = 1,
  FRONT = 2;

const READ = { u1: Uint8Array, i1: Int8Array, i4: Int32Array, f8: Float64Array };

/** Read all of the page. @returns {Promise<Model>} */
export async function readModel() {
  const study = JSON.parse(document.getElementById("study").textContent);
  const columns = await Promise.all(
    study.columns.map(async (column) => {
      const declared = Float64Array.from(await unpack(column.packed));
      return { ...column, declared, values: inShownUnit(declared, column.ratio) };
    }),
  );
  const designs = Float64Array.from(await unpack(study.designs));
  const kinds = Uint8Array.from(await unpack(study.kinds));
  const byName = new Map(columns.map((column) => [column.name, column]));
  return { study, columns, byName, designs, kinds, size: designs.length };
}

/** Values in the unit that the page shows. */
const inShownUnit = (values, ratio) => (ratio ? values.map((one) => shown(one, ratio)) : values);

/** A value in the unit that the page shows: ten digits where those are as near, as `explore.base.units.shown` has it. */
export function shown(value, [multiplier, divisor]) {
  const exact = (value * multiplier) / divisor;
  const places = 9 - Math.floor(Math.log10(Math.abs(exact)));
  if (!(Math.abs(places) <= 22)) return exact;
  const [up, down] = [places, -places].map((digits) => Number(`1e${Math.max(digits, 0)}`)); // exact powers
  const short = (Math.round((exact * up) / down) / up) * down;
  return Math.abs(short - exact) <= 4 * 2 ** -53 * Math.abs(exact) ? short : exact;
}

/**
 * One column: base64, deflate, then bytes of the same weight put beside each other again, NaN where not defined.
 * @param {{text: number, type: string, length: number, defined?: number}} place
 */
export async function unpack(place) {
  const values = await unshuffled(place.text, READ[place.type]);
  if (place.defined === undefined) return checked(values, place.length);
  const defined = checked(await unshuffled(place.defined, Uint8Array), place.length);
  const all = new Float64Array(place.length).fill(NaN);
  let next = 0;
  for (let i = 0; i < all.length; i++) if (defined[i]) all[i] = values[next++];
  checked(values, next);
  return all;
}

function checked(values, length) {
  if (values.length !== length) throw new Error("the length of a column is wrong, so the file is damaged");
  return values;
}

async function unshuffled(text, kind) {
  const planes = await inflate(decode(document.getElementById(`data-${text}`).textContent));
  const width = kind.BYTES_PER_ELEMENT,
    length = planes.length / width;
  const bytes = new Uint8Array(planes.length);
  for (let k = 0; k < width; k++) {
    const start = k * length;
    for (let i = 0; i < length; i++) bytes[i * width + k] = planes[start + i];
  }
  return new kind(bytes.buffer); // the bytes are little-endian, as every machine that runs a browser today
}

function decode(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
