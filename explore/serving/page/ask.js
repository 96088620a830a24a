/** Ask the service; an error of it becomes an Error with its sentence and the problems of a study. */
export async function ask(method, path, content) {
  const request = { method, headers: {} };
  if (content !== undefined) {
    request.body = JSON.stringify(content);
    request.headers["Content-Type"] = "application/json";
  }
  const answer = await fetch(path, request);
  const facts = answer.status === 204 ? {} : await answer.json();
  if (!answer.ok) throw Object.assign(new Error(facts.detail), { status: answer.status, problems: facts.problems ?? [] });
  return facts;
}
