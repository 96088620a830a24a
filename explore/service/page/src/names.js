/** A name that no job has: the name itself, or with a number. */
export function freeName(name, jobs) {
  let free = name;
  for (let k = 2; jobs.has(free); k++) free = `${name.slice(0, 60)}-${k}`;
  return free;
}
