/** Ask the service; an error of it becomes an Error with its sentence and the problems of a study. */
export async function ask(method, path, content) {
  const request = { method, headers: {} };
  if (content !== undefined) {
    request.body = JSON.stringify(content);
    request.headers["Content-Type"] = "application/json";
  }
  const answer = await checked(await fetch(path, request));
  return answer.status === 204 ? {} : answer.json();
}

/** A text of the service, such as that of a study. */
export async function askText(path) {
  return (await checked(await fetch(path))).text();
}

async function checked(answer) {
  if (answer.ok) return answer;
  const facts = await answer.json();
  throw Object.assign(new Error(facts.detail), { status: answer.status, problems: facts.problems ?? [] });
}
