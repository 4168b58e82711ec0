// The page as its users see it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { browser, ended, here, saved, statusOf, type, withPage } from "./browser.mjs";

after(() => browser.close());

const OSCILLATOR = `version = 2
[system]
coordinates = ["q"]
lagrangian = "q'^2/2 - q^2/2 + gamma*z"
parameters = { gamma = -0.1 }
[start]
q = 1.0
"q'" = 0.0
[run]
time = 20.0
integrator = "midpoint"
step = 0.1
[want]
rows = { every_step = 10, columns = ["t", "q", "q'", "z", "energy"] }
`;

// Problem P2 of the work-precision diagrams.
const PENDULUM = `version = 2
[system]
coordinates = ["q"]
lagrangian = "q'^2/2 - 1 + cos(q) + g*z"
parameters = { g = -0.01 }
[start]
q = 1.0
"q'" = 1.0
[run]
time = 100.0
integrator = "gauss_8"
step = 0.5
[want]
rows = { every_step = 10, columns = ["t", "q", "q'", "z", "energy"] }
`;

const LONG = PENDULUM.replace("g = -0.01", "g = 0.0").replace("time = 100.0", "time = 3e7").replace("every_step = 10", "every_step = 100000");

const withError = OSCILLATOR.replace("q^2/2 + gamma", "q^2/2 + gama");

/// The program, which CI builds.
const program = process.env.PROGRAM ?? join(here, "../../target/release/herglotz");

const numbersOf = (csv) => csv.trim().split("\n").slice(1).map((line) => line.split(",").map(Number));

const EXAMPLES = ["pendulum", "kepler", "double_pendulum", "bouncing", "stick_slip", "duffing", "heavy_top", "linkage", "van_der_pol", "thermostat", "lane_emden", "kinks"];

test("every example runs and has figures", async () => {
  await withPage(async (page) => {
    assert.deepEqual(await page.$$eval("#example option", (all) => all.map((option) => option.value)), EXAMPLES);
    for (const name of EXAMPLES) {
      await page.selectOption("#example", name);
      await ended(page);
      assert.match(await statusOf(page), /^(completed|stopped by an event)/, name);
      assert.doesNotMatch(await statusOf(page), /finite/, name);
      assert.equal(await page.textContent("#error"), "", name);
      const figures = await page.$$eval('#figures svg[role="img"]', (all) => all.map((svg) => svg.querySelectorAll("path[d], circle, image").length));
      assert.ok(figures.length >= 4 && figures.every((marks) => marks > 0), `${name}: ${figures}`);
      assert.ok((await page.$$eval("#figures path", (all) => all.filter((path) => /NaN|Infinity/.test(path.getAttribute("d"))).length)) === 0, name);
    }
  });
});

test("the numbers are those of the program", { skip: existsSync(program) ? false : "there is no program" }, async () => {
  await withPage(async (page) => {
    for (const scene of [OSCILLATOR, PENDULUM]) {
      const folder = mkdtempSync(join(tmpdir(), "page-"));
      writeFileSync(join(folder, "scene.toml"), scene);
      execFileSync(program, ["run", join(folder, "scene.toml"), "--out", folder]);
      const native = numbersOf(readFileSync(join(folder, "rows.csv"), "utf8"));
      await type(page, scene);
      const ours = numbersOf(await saved(page, "#csv"));
      assert.equal(ours.length, native.length);
      // The products and sums of the program are fused; 1e-12 is what some hundred steps make of that.
      native.forEach((row, k) => row.forEach((x, i) => assert.ok(Math.abs(x - ours[k][i]) <= 1e-12 * Math.max(1, Math.abs(x)), `row ${k}, column ${i}: ${x}, ${ours[k][i]}`)));
    }
  });
});

test("a figure is saved as a picture that stands by itself", async () => {
  await withPage(async (page) => {
    for (const name of await page.$$eval("#figures figure[data-name]", (all) => all.map((figure) => figure.dataset.name))) {
      const svg = await saved(page, `#figures figure[data-name="${name}"] button`);
      assert.match(svg, /^<svg [^>]*xmlns="http:\/\/www\.w3\.org\/2000\/svg"/, name);
      assert.doesNotMatch(svg, /var\(|NaN|Infinity/, name);
      const picture = await page.evaluate((text) => {
        const read = new DOMParser().parseFromString(text, "image/svg+xml");
        return { error: read.querySelector("parsererror")?.textContent ?? "", marks: read.querySelectorAll("path[d], circle").length, texts: read.querySelectorAll("text").length };
      }, svg);
      assert.ok(picture.error === "" && picture.marks > 0 && picture.texts > 4, `${name}: ${JSON.stringify(picture)}`);
    }
  });
});

test("a Lagrangian that is typed runs", async () => {
  await withPage(async (page) => {
    await page.fill("#lagrangian", "m*x'^2/2 - k*x^4/4 + gamma*z");
    await page.press("#lagrangian", "Enter");
    await page.waitForFunction(() => document.getElementById("scene").value.includes("k*x^4/4"));
    await ended(page);
    assert.match(await statusOf(page), /^completed/);
    assert.match(await page.inputValue("#scene"), /parameters = \{ m = 1.0, k = 1.0, gamma = -0.1 \}/);
    assert.match(await page.textContent("#properties"), /L_z is constant/);
  });
});

// Kernels that no example has: the engine of the page has few of them.
test("more coordinates than a kernel has, and constraints on few", async () => {
  await withPage(async (page) => {
    const masses = Array.from({ length: 6 }, (_, k) => `x${k + 1}`);
    const springs = masses.slice(1).map((name, k) => `(${name} - ${masses[k]})^4`);
    const chain = `version = 2
[system]
coordinates = [${masses.map((name) => `"${name}"`).join(", ")}]
lagrangian = "(${masses.map((name) => `${name}'^2`).join(" + ")})/2 - ${springs.join(" - ")} - z/10"
[start]
${masses.map((name, k) => `${name} = ${k}.0\n"${name}'" = ${k % 2}.0`).join("\n")}
[run]
time = 5.0
accuracy = 1e-8
[want]
rows = { every = 0.1, columns = ["t"] }
`;
    await type(page, chain);
    assert.match(await statusOf(page), /^completed/);
    assert.match(await page.textContent("#properties"), /p_x1 \+ p_x2/);
    assert.match(await page.textContent("#plan"), /the last step, [^]*the defect of the contact form is \d\.\de-1\d/);
    await type(page, chain.replace("accuracy = 1e-8", 'integrator = "strang"\nstep = 0.1'));
    assert.match(await page.textContent("#error"), /at most 4 coordinates/);
    await type(
      page,
      `version = 2
[system]
coordinates = ["x", "y"]
lagrangian = "(x'^2 + y'^2)/2 - g*y + gamma*z"
constraints = ["x^2 + y^2 = 1"]
parameters = { g = 9.81, gamma = -0.1 }
[start]
x = 1.0
y = 0.0
"x'" = 0.0
"y'" = 0.0
[run]
time = 5.0
accuracy = 1e-8
[want]
rows = { every = 0.1, columns = ["t", "x", "y"] }
`,
    );
    assert.match(await statusOf(page), /^completed/);
    const rows = numbersOf(await saved(page, "#csv"));
    assert.ok(rows.length === 51 && rows.every(([, x, y]) => Math.abs(x * x + y * y - 1) < 1e-12));
  });
});

test("an error is shown at its place, and the page goes on", async () => {
  await withPage(async (page) => {
    await type(page, withError);
    const error = await page.textContent("#error");
    const line = withError.split("\n").findIndex((text) => text.includes("gama")) + 1;
    assert.match(error, new RegExp(`^line ${line}, column \\d+: unknown name \`gama\`; did you mean gamma\\?`));
    const [text, mark] = error.split("\n").slice(1);
    assert.equal(text.slice(mark.indexOf("^"), mark.lastIndexOf("^") + 1), "gama");
    for (const odd of ["", "x", "[system]", OSCILLATOR.replace("1.0", "1e400"), OSCILLATOR.replace("step = 0.1", "step = 0.0"), "\u0000\u{1f600}", OSCILLATOR.replace('["q"]', '["q", "q1", "q2", "q3", "q4", "q5", "q6", "q7", "q8"]')]) {
      await type(page, odd);
      assert.notEqual(await page.textContent("#error"), "", odd);
      assert.doesNotMatch(await statusOf(page), /fault/, odd);
    }
    await type(page, OSCILLATOR);
    assert.match(await statusOf(page), /^completed; 200 steps by midpoint/);
    assert.equal(await page.textContent("#error"), "");
  });
});

test("numbers that are not finite are named", async () => {
  await withPage(async (page) => {
    await type(page, OSCILLATOR.replace('"energy"]', '"energy", "log(q)"]'));
    assert.match(await statusOf(page), /Not a finite number in some rows: log\(q\)/);
  });
});

test("a slider changes the motion while it moves", async () => {
  await withPage(async (page) => {
    await type(page, OSCILLATOR);
    const curve = () => page.getAttribute('[data-name="coordinates"] svg[role="img"] g[aria-label="line"] path', "d");
    const before = await curve();
    const rate = await page.evaluate(async () => {
      const slider = document.getElementById("slider-gamma");
      let drawn = 0;
      const watch = new MutationObserver(() => (drawn += 1));
      watch.observe(document.getElementById("figures"), { childList: true });
      const began = performance.now();
      while (performance.now() - began < 1500) {
        slider.value = Number(slider.value) + 0.001;
        slider.dispatchEvent(new Event("input"));
        await new Promise((next) => setTimeout(next, 5));
      }
      slider.dispatchEvent(new Event("change"));
      watch.disconnect();
      return (1000 * drawn) / (performance.now() - began);
    });
    await ended(page);
    console.log(`${rate.toFixed(0)} pictures in a second while a slider moves`);
    assert.notEqual(await curve(), before);
    // The scene file has the value of the slider.
    const value = await page.inputValue('input[data-name="gamma"]:not([type="range"])');
    assert.match(await saved(page, "#save"), new RegExp(`gamma = ${value.replace(".", "\\.").replace("-", "\\-")}`));
  });
});

test("the start is dragged in the phase portrait", async () => {
  await withPage(async (page) => {
    await type(page, OSCILLATOR);
    const box = await page.locator('[data-name="phase"] svg[role="img"]').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 3);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2.2, box.y + box.height / 2.5, { steps: 4 });
    await page.mouse.up();
    await ended(page);
    const [q, v] = await Promise.all(["start.q", "start.q'"].map((name) => page.inputValue(`input[data-name="${name}"]:not([type="range"])`)));
    assert.ok(Math.abs(q) < 0.5 && Number(v) > 0, `${q}, ${v}`);
  });
});

test("a link has the scene and its values", async () => {
  let hash;
  await withPage(async (page) => {
    await type(page, OSCILLATOR);
    await page.fill('input[data-name="gamma"]:not([type="range"])', "-0.25");
    await page.press('input[data-name="gamma"]:not([type="range"])', "Tab");
    await ended(page);
    await page.click("#link");
    await page.waitForFunction(() => location.hash.length > 10);
    hash = await page.evaluate(() => location.hash);
  });
  await withPage(
    async (page) => {
      assert.equal(await page.inputValue("#scene"), OSCILLATOR);
      const first = numbersOf(await saved(page, "#csv"));
      await type(page, OSCILLATOR.replace("gamma = -0.1", "gamma = -0.25"));
      assert.deepEqual(numbersOf(await saved(page, "#csv")), first);
    },
    { hash },
  );
  await withPage(async (page) => assert.match(await page.textContent("#said"), /damaged/), { hash: "#nothing" });
});

test("a run can be stopped, and is ended after ten seconds with what it has", async () => {
  await withPage(async (page) => {
    await page.fill("#scene", LONG);
    await page.waitForFunction(() => !document.getElementById("stop").disabled && document.getElementById("status").textContent === "Running.");
    await page.click("#stop");
    await ended(page, 2000);
    assert.match(await statusOf(page), /^Stopped/);
    await page.click("#run");
    await page.waitForFunction(() => !document.getElementById("stop").disabled);
    await ended(page, 25_000);
    assert.match(await statusOf(page), /^ended after 10 s at t = /);
    assert.ok(numbersOf(await saved(page, "#csv")).length > 3);
  });
});

test("forces, backward time, the cloud and the Runge-Kutta method", async () => {
  await withPage(async (page) => {
    await type(page, PENDULUM.replace("step = 0.5", "step = 1.0"));
    await page.check("#peer");
    await ended(page);
    await page.check("#cloud");
    await ended(page);
    const names = await page.$$eval("#figures figure[data-name]", (all) => all.map((figure) => figure.dataset.name));
    for (const name of ["law", "cloud", "area", "area_law"]) assert.ok(names.includes(name), `${name} of ${names}`);
    // The area obeys the law to round-off, and that of the Runge-Kutta method does not.
    const heights = await page.$$eval('[data-name="area_law"] svg[role="img"] g[aria-label="line"] path', (all) =>
      all.map((path) => Number(path.getAttribute("d").split(",").at(-1))),
    );
    assert.ok(heights.length === 2 && heights[0] - heights[1] > 40, `${heights}`);
    assert.match(await page.textContent("#plan"), /the last step, from t = 99: [^]*the defect of the contact form is \d\.\de-1\d/);
    await page.click("#backward");
    await ended(page);
    assert.match(await statusOf(page), /^completed/);
    await page.click("#backward");
    await ended(page);
    await type(page, `${OSCILLATOR}\n[force]\nq = "-0.1*q'*abs(q')"\n`);
    assert.match(await statusOf(page), /^completed/);
  });
});

test("Python and Rust, keyboard, dark, and a narrow screen", async () => {
  await withPage(
    async (page) => {
      await type(page, OSCILLATOR);
      const file = await saved(page, "#python");
      assert.equal(file, OSCILLATOR);
      assert.match(await page.textContent("#code"), /hz\.run\("scene\.toml"\)/);
      await saved(page, "#rust");
      assert.match(await page.textContent("#code"), /Scene::read_with/);
      await page.focus("#scene");
      await page.keyboard.press("Control+Enter");
      await ended(page);
      await page.click("#theme");
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 0, `${wide} pixels too wide`);
      // What can be clicked can be reached by the keyboard.
      const unreachable = await page.$$eval("button, input, select, textarea", (all) => all.filter((control) => control.tabIndex < 0).length);
      assert.equal(unreachable, 0);
    },
    { width: 375 },
  );
});

test("pictures of four states", async () => {
  const folder = process.env.PICTURES;
  if (!folder) return;
  const states = [
    ["kepler", 1280, ["#peer"]],
    ["heavy_top", 1280, ["#theme"]],
    ["linkage", 375, []],
    ["kinks", 1280, []],
  ];
  for (const [name, width, clicks] of states) {
    await withPage(
      async (page) => {
        await page.selectOption("#example", name);
        await ended(page);
        for (const button of clicks) {
          await page.click(button);
          await ended(page);
        }
        await page.waitForTimeout(1500);
        await page.screenshot({ path: join(folder, `page_${name}.png`), fullPage: width < 1000 });
      },
      { width },
    );
  }
});
