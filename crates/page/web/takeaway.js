// What a user takes away: rows, figures, the scene, and the lines of Python and Rust that give the same numbers.

const save = (name, text, type) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

const csvOf = (rows, columns) => {
  const of = columns.map((name) => rows.column(name));
  const quoted = columns.map((name) => (/[",]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name));
  const lines = [quoted.join(",")];
  for (let row = 0; row < rows.count; row++) lines.push(of.map((column) => column(row)).join(","));
  return `${lines.join("\n")}\n`;
};

export const saveCsv = (rows, columns) => save("rows.csv", csvOf(rows, columns), "text/csv");

export const saveScene = (text) => save("scene.toml", text, "text/plain");

export const saveSvg = (name, svg) => {
  const copy = svg.cloneNode(true);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  // In a file there are no styles of the page.
  const style = getComputedStyle(document.documentElement);
  const text = new XMLSerializer().serializeToString(copy);
  const resolved = text.replace(/var\((--[a-z]+)\)/g, (_, variable) => style.getPropertyValue(variable).trim());
  save(`${name}.svg`, resolved, "image/svg+xml");
};

/// Values that are changed, as pairs.
const pairs = (changes) => changes.map((change) => change.split(/=(.*)/s).slice(0, 2));

const valueOf = (text) => (Number.isNaN(Number(text)) ? JSON.stringify(text) : text);

export const python = (changes) => {
  const given = pairs(changes).map(([name, value]) => `${JSON.stringify(name)}: ${valueOf(value)}`);
  return `import herglotz as hz

# scene.toml is the scene file of this page.
solution = hz.run("scene.toml"${given.length ? `, {${given.join(", ")}}` : ""})
print(solution.status, solution.t[-1], solution.q[-1])
`;
};

export const rust = (changes) => `// scene.toml is the scene file of this page.
let text = std::fs::read_to_string("scene.toml")?;
let changes = [${changes.map((change) => JSON.stringify(change)).join(", ")}].map(str::to_owned);
let scene = herglotz::Scene::read_with(&text, &changes)?;
let (outcome, rows) = scene.system.record(&scene.motion())?;
println!("{}: {:?}", outcome.status, rows.last());
`;
