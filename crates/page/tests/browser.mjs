// A page in Chromium, from the file on the disk.
import { existsSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

export const here = dirname(dirname(fileURLToPath(import.meta.url)));
const address = pathToFileURL(join(here, "dist/index.html")).href;

const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
const args = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

export const browser = await chromium.launch({ executablePath, args });

/// The states in which a run has ended.
const ENDED = /completed|stopped|Stopped|ended|failed|error|fault|unreliable/;

/// A page that is shown, with the messages of its console. The function is given it, and a message is a failure.
export const withPage = async (work, { width = 1280, hash = "", wait = true } = {}) => {
  const context = await browser.newContext({ viewport: { width, height: 900 }, acceptDownloads: true });
  const page = await context.newPage();
  const messages = [];
  page.on("console", (message) => messages.push(message.text()));
  page.on("pageerror", (error) => messages.push(error.message));
  await page.goto(address + hash);
  if (wait) await ended(page);
  try {
    await work(page);
  } finally {
    await context.close();
  }
  if (messages.length) throw new Error(`the console has messages: ${messages.join("; ")}`);
};

/// Waits until nothing is computed.
export const ended = async (page, timeout = 30_000) => {
  await page.waitForFunction(
    (of) => document.getElementById("stop").disabled && new RegExp(of).test(document.getElementById("status").textContent),
    ENDED.source,
    { timeout },
  );
};

export const statusOf = (page) => page.textContent("#status");

/// Types a scene.
export const type = async (page, scene) => {
  await page.fill("#scene", scene);
  // It is run once no key has been pressed for a while.
  await page.waitForTimeout(450);
  await ended(page);
};

/// The text of what a button saves.
export const saved = async (page, button) => {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(button)]);
  const parts = [];
  for await (const part of await download.createReadStream()) parts.push(part);
  return Buffer.concat(parts).toString("utf8");
};
