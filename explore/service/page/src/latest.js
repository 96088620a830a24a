/** Requests that follow each other so quickly that only the newest answer counts. */

/**
 * A function that asks at once, or again as soon as the running request is answered; what was asked between is left out.
 * @param {() => Promise<any>} request
 * @param {(answer: any) => void} show called with each answer
 * @param {(error: Error) => void} fail
 */
export function latest(request, show, fail) {
  let isRunning = false,
    isWanted = false;
  async function run() {
    isWanted = true;
    if (isRunning) return;
    isRunning = true;
    while (isWanted) {
      isWanted = false;
      try {
        show(await request());
      } catch (error) {
        fail(error);
      }
    }
    isRunning = false;
  }
  return run;
}
