'use strict';
// Filters, counts and links the samples. Plotly draws.
const BINS = 40, CELLS = [10, 40], MOST_POINTS = 250, LISTED = 25, MISSING = 255;
const byId = id => document.getElementById(id);
const unpacked = async id => {
  const text = atob(byId(id).textContent.trim()), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).text();
};
const made = (name, attributes = {}, ...children) => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) key in element ? element[key] = value : element.setAttribute(key, value);
  element.append(...children);
  return element;
};
let data, samples, arm, order, shown = [], current = null, panels = [], asked = 0;

// The samples of a scenario: typed arrays, made when the scenario is chosen.
const load = index => {
  const scenario = data.scenarios[index], count = scenario.numbers.length;
  const typed = column => ({ ...column, bins: {}, values: Float32Array.from(column.values, value => value ?? NaN) });
  samples = { ...scenario, index, count, mask: new Uint8Array(count), row: new Map(scenario.numbers.map((number, row) => [number, row])),
    parameters: scenario.parameters.map(typed), outcomes: scenario.outcomes.map(columns => columns.map(typed)) };
  // An even choice of points: the samples in the order of a hash of their number.
  const hash = Float64Array.from(scenario.numbers, number => (Math.imul(number + 1, 2654435761) ^ (number << 7)) >>> 0);
  order = Uint32Array.from(hash.keys()).sort((one, other) => hash[one] - hash[other]);
};
const columns = () => [...samples.parameters, ...samples.outcomes[arm]];
const column = name => columns().find(one => one.name === name);
const fateWord = fate => samples.is_paired ? data.fates[fate].pair : data.fates[fate].single;
const isDark = () => matchMedia('(prefers-color-scheme: dark)').matches && !matchMedia('print').matches;
// The colours of the report, as far as they differ from the page by a contrast of 3 : 1.
const CONTRAST = { light: {}, dark: { '#111111': '#f0f3f6', '#b00020': '#ff5c6c', '#1f77b4': '#4a9fe0' } };
const fateColour = fate => CONTRAST[isDark() ? 'dark' : 'light'][data.fates[fate].colour] ?? data.fates[fate].colour;

// The ends of a column, and the bin of each value in it.
const ends = one => {
  if (one.ends) return one.ends;
  if (one.words) return one.ends = [-0.5, one.words.length - 0.5];
  let [low, high] = [Infinity, -Infinity];
  for (const value of one.values) { if (value < low) low = value; if (value > high) high = value; }
  if (!(low < high)) [low, high] = Number.isFinite(low) ? [low - 0.5, low + 0.5] : [0, 1];
  return one.ends = [low, high];
};
const binned = (one, most) => {
  if (one.bins[most]) return one.bins[most];
  const [low, high] = ends(one), count = one.words ? one.words.length : most, at = new Uint8Array(samples.count);
  for (let row = 0; row < at.length; row++) {
    const bin = Math.floor((one.values[row] - low) / (high - low) * count);
    at[row] = Number.isNaN(one.values[row]) ? MISSING : Math.min(Math.max(bin, 0), count - 1);
  }
  const width = (high - low) / count;
  return one.bins[most] = { at, count, width, centres: Array.from({ length: count }, (_, bin) => low + (bin + 0.5) * width) };
};

// A sample is chosen if it passes all filters and lies in all brushes.
const select = () => {
  const form = byId('filters').elements, { mask, fates, count } = samples;
  const isOn = data.fates.map((_, fate) => !document.querySelector(`#fates input[value="${fate}"]`) ||
    document.querySelector(`#fates input[value="${fate}"]`).checked);
  const tests = [];
  for (const [name, of] of [['reason', 'mis_reason'], ['cause', 'cause']]) {
    const value = form[name].value, values = column(of)?.values;
    if (value !== '' && values) tests.push([values, value - 0.5, Number(value) + 0.5]);
  }
  for (const { brush } of panels) for (const [name, low, high] of brush) tests.push([column(name)?.values ?? [], low, high]);
  let chosen = 0;
  const counts = data.fates.map(() => 0);
  for (let row = 0; row < count; row++) {
    let isIn = isOn[fates[row]];
    for (const [values, low, high] of tests) isIn = isIn && values[row] >= low && values[row] <= high;
    mask[row] = isIn ? 1 : 0;
    if (isIn) { chosen++; counts[fates[row]]++; }
  }
  const parts = counts.map((number, fate) => number ? `${number.toLocaleString('en')} ${fateWord(fate)}` : '').filter(Boolean);
  byId('counts').textContent = `${chosen.toLocaleString('en')} of ${count.toLocaleString('en')} samples` +
    (parts.length ? `: ${parts.join(', ')}` : '');
};

const style = () => {
  const css = getComputedStyle(document.documentElement), of = name => css.getPropertyValue(name).trim();
  return { ink: of('--ink'), soft: of('--soft'), line: of('--line'), sheet: of('--sheet'), link: of('--link') };
};
// The points at the ends of a column lie inside its axis.
const roomy = one => {
  const [low, high] = ends(one), room = one.words ? 0 : 0.02 * (high - low);
  return [low - room, high + room];
};
const axis = (one, colours) => ({
  title: { text: one.label, standoff: 6 }, range: roomy(one), automargin: true, gridcolor: colours.line, zeroline: false,
  linecolor: colours.soft, fixedrange: true,
  ...(one.words ? { tickvals: one.words.map((_, index) => index), ticktext: one.words.map(word => word.length > 24 ? word.slice(0, 23) + '…' : word) } : {}),
});
const layout = (colours, more) => ({
  dragmode: 'select', showlegend: false, margin: { l: 48, r: 12, t: 8, b: 36 }, paper_bgcolor: colours.sheet, plot_bgcolor: colours.sheet,
  font: { color: colours.ink, size: 12, family: 'system-ui, sans-serif' }, hovermode: 'closest', selections: [],
  hoverlabel: { bgcolor: colours.sheet, bordercolor: colours.soft, font: { color: colours.ink } },
  newselection: { line: { color: colours.link, width: 2 } }, activeselection: { fillcolor: colours.link, opacity: 0.2 }, ...more,
});
const config = { displayModeBar: false, logging: 0, responsive: true, doubleClick: false, scrollZoom: false };
const box = (colours, more) => ({ type: 'rect', line: { color: colours.link, width: 2 }, fillcolor: colours.link, opacity: 0.15, layer: 'above', ...more });

const drawHistogram = panel => {
  const one = column(panel.x.value), { at, count, width, centres } = binned(one, BINS), { mask, fates } = samples;
  const all = new Float64Array(count), parts = data.fates.map(() => new Float64Array(count));
  for (let row = 0; row < at.length; row++) {
    if (at[row] === MISSING) continue;
    all[at[row]]++;
    if (mask[row]) parts[fates[row]][at[row]]++;
  }
  const colours = style(), base = new Float64Array(count), bars = { type: 'bar', x: centres, width: width * 0.96, hoverinfo: 'none' };
  const traces = [{ ...bars, y: all, marker: { color: colours.line } }];
  parts.forEach((y, fate) => {
    traces.push({ ...bars, y, base: base.slice(), marker: { color: fateColour(fate) } });
    for (let bin = 0; bin < count; bin++) base[bin] += y[bin];
  });
  const brush = panel.brush[0], shapes = brush ? [box(colours, { xref: 'x', yref: 'paper', x0: brush[1], x1: brush[2], y0: 0, y1: 1 })] : [];
  const y = { title: { text: 'samples' }, gridcolor: colours.line, fixedrange: true, rangemode: 'tozero', automargin: true };
  return Plotly.react(panel.chart, traces,
    layout(colours, { barmode: 'overlay', selectdirection: 'h', xaxis: axis(one, colours), yaxis: y, shapes }), config);
};

const drawPlane = panel => {
  // A cell has some ten samples, if there are as many.
  const cellCount = Math.min(Math.max(Math.round(Math.sqrt(samples.count / 10)), CELLS[0]), CELLS[1]);
  const [across, up] = [column(panel.x.value), column(panel.y.value)], [x, y] = [binned(across, cellCount), binned(up, cellCount)];
  const { mask, fates, numbers, count } = samples, isMap = panel.id === 'map', collided = [false, false, true, true, false];
  const cells = new Float64Array(x.count * y.count), hits = new Float64Array(x.count * y.count);
  for (let row = 0; row < count; row++) {
    if (!mask[row] || x.at[row] === MISSING || y.at[row] === MISSING) continue;
    const cell = y.at[row] * x.count + x.at[row];
    cells[cell]++;
    if (collided[fates[row]]) hits[cell]++;
  }
  const value = cell => !cells[cell] ? null : isMap ? hits[cell] / cells[cell] : Math.log10(1 + cells[cell]);
  const z = Array.from({ length: y.count }, (_, row) => Array.from({ length: x.count }, (_, bin) => value(row * x.count + bin)));
  const colours = style(), shade = isMap ? [[0, 'rgba(211,84,0,0)'], [1, 'rgba(211,84,0,0.55)']] : [[0, 'rgba(110,125,145,0.05)'], [1, 'rgba(110,125,145,0.6)']];
  const traces = [{ type: 'heatmap', x: x.centres, y: y.centres, z, colorscale: shade, showscale: false, hoverinfo: 'skip', zmin: 0, ...(isMap ? { zmax: 1 } : {}) }];
  const points = data.fates.map(() => []);
  for (const row of order) if (mask[row] && points[fates[row]].length < MOST_POINTS && across.values[row] === across.values[row] && up.values[row] === up.values[row]) points[fates[row]].push(row);
  // The points at one word are spread.
  const spread = (one, row, salt) => one.values[row] + (one.words ? ((Math.imul(row + salt, 2654435761) >>> 0) / 2 ** 32 - 0.5) * 0.6 : 0);
  points.forEach((rows, fate) => traces.push({
    type: 'scatter', mode: 'markers', x: rows.map(row => spread(across, row, 1)), y: rows.map(row => spread(up, row, 2)), customdata: rows,
    text: rows.map(row => `sample ${numbers[row]}: ${fateWord(fate)}`), hoverinfo: 'text', marker: { color: fateColour(fate), size: fate === 0 ? 5 : 7 },
  }));
  if (current !== null && across.values[current] === across.values[current] && up.values[current] === up.values[current]) traces.push({
    type: 'scatter', mode: 'markers', x: [spread(across, current, 1)], y: [spread(up, current, 2)], hoverinfo: 'skip',
    marker: { symbol: 'circle-open', size: 16, color: colours.ink, line: { width: 3 } },
  });
  const brush = panel.brush, shapes = brush.length ? [box(colours, { xref: 'x', yref: 'y', x0: brush[0][1], x1: brush[0][2], y0: brush[1][1], y1: brush[1][2] })] : [];
  return Plotly.react(panel.chart, traces, layout(colours, { xaxis: axis(across, colours), yaxis: axis(up, colours), shapes }), config);
};

// The rows in the order of gravity: by the outcome, then by each of these columns; 1 if a small value is grave, -1 if a large one is.
// The harm is the order of the report and of the recordings.
const GRAVITY = [['harm', -1], ['collision_relative_speed_mps', -1], ['touch_relative_speed_mps', -1], ['min_ttc_rear_s', 1], ['min_thw_rear_s', 1]];
const gravest = () => {
  const by = samples.gravest ??= {};
  if (by[arm]) return by[arm];
  const keys = GRAVITY.map(([name, sign]) => [column(name)?.values, sign]).filter(([values]) => values);
  const key = (values, sign, row) => Number.isNaN(values[row]) ? Infinity : sign * values[row];
  return by[arm] = Uint32Array.from({ length: samples.count }, (_, row) => row).sort((one, other) => {
    if (samples.fates[one] !== samples.fates[other]) return samples.fates[other] - samples.fates[one];
    for (const [values, sign] of keys) {
      const [first, second] = [key(values, sign, one), key(values, sign, other)];
      if (first !== second) return first < second ? -1 : 1;
    }
    return one - other;
  });
};
const list = () => {
  const chosen = gravest().filter(row => samples.mask[row]);
  shown = Array.from(chosen.subarray(0, LISTED));
  const listed = ['mis_reason', 'cause', 'harm', 'collision_relative_speed_mps', 'touch_relative_speed_mps', 'min_ttc_rear_s', 'min_thw_rear_s'].map(column).filter(Boolean);
  const head = made('tr', {}, ...['sample', 'outcome', ...listed.map(one => one.label), 'recording'].map(name => made('th', {}, name)));
  const rows = shown.map(row => {
    const number = samples.numbers[row], recording = data.recordings[samples.index][number];
    const cells = [made('button', { type: 'button', onclick: () => show(row) }, String(number)), fateWord(samples.fates[row]), ...listed.map(one => valueText(one, row)),
      recording ? made('a', { href: recording[1], target: '_blank', rel: 'noopener' }, 'incident card') : ''];
    return made('tr', {}, ...cells.map((cell, index) => {
      const td = made('td', {}, cell);
      td.dataset.name = head.children[index].textContent;
      return td;
    }));
  });
  const counted = `${shown.length} of ${chosen.length.toLocaleString('en')} chosen samples: by outcome, then by harm, then by speeds and margins`;
  byId('list').replaceChildren(made('p', { className: 'note' }, counted), made('div', { className: 'wide', tabIndex: 0 }, made('table', {}, made('thead', {}, head), made('tbody', {}, ...rows))));
};

// Draws all charts but `except`, in which the pointer draws a brush. At the end of a brush the others show it already: `only` is left.
const update = (except, only) => {
  const start = performance.now();
  select();
  const changed = only ? [only] : panels.filter(panel => panel !== except);
  const drawn = changed.map(panel => panel.y ? drawPlane(panel) : drawHistogram(panel));
  for (const panel of panels) if (!only) panel.shown = panel === except ? JSON.stringify(panel.brush) : null;
  if (!except) list();
  for (const panel of panels) {
    panel.clear.hidden = !panel.brush.length;
    if (panel.from && document.activeElement !== panel.from && document.activeElement !== panel.to)
      [panel.from.value, panel.to.value] = panel.brush.length ? panel.brush[0].slice(1).map(value => Number(value.toPrecision(4))) : ['', ''];
  }
  return Promise.all(drawn).then(() => performance.measure('update', { start, end: performance.now() }));
};
// The chart tells of a drawn brush up to a frame, or 50 ms, later. A brush that is cleared by then stays cleared.
const clearBrush = panel => { panel.brush = []; panel.isDrawn = false; };
const setBrush = (panel, range) => {
  panel.brush = [];
  const sorted = ([one, other]) => one < other ? [one, other] : [other, one];
  if (range?.x) panel.brush.push([panel.x.value, ...sorted(range.x)]);
  if (range?.y && panel.y) panel.brush.push([panel.y.value, ...sorted(range.y)]);
};

const valueText = (one, row) => {
  const value = one.values[row];
  return Number.isNaN(value) ? '–' : one.words ? one.words[value] : String(Number(value.toPrecision(4)));
};
// Who struck whom in one arm, and what its columns say about the reason. A constant column is left out of the page, and of the sentence.
const told = (columns, row) => {
  const of = name => {
    const one = columns.find(column => column.name === name);
    return one && !Number.isNaN(one.values[row]) ? valueText(one, row) : null;
  };
  const isKnown = column => !Number.isNaN(column.values[row]);
  if (!columns.some(isKnown)) return 'no outcome';
  const hasCollided = columns.some(column => column.name.startsWith('collision_') && isKnown(column));
  const [first, second, closed] = ['first', 'second'].map(which => of(`collision_between_${which}`)).concat(of('collision_closed_by'));
  const [striking, struck] = closed === 'second' ? [second, first] : [first, second];
  const parts = [!hasCollided ? 'no collision' : first === null || second === null ? 'collision' : closed === 'first' || closed === 'second' ? `${striking} struck ${struck}` : `${first} and ${second} collided`];
  for (const [word, name, unit] of [['at', 'collision_relative_speed_mps', ' m/s'], ['at', 'collision_time_s', ' s']])
    if (of(name) !== null) parts[0] += ` ${word} ${of(name)}${unit}`;
  for (const [word, name] of [['reason of the MIS', 'mis_reason'], ['cause', 'cause']]) if (of(name) !== null) parts.push(`${word}: ${of(name)}`);
  return parts.join('; ');
};
const table = (heads, rows) => made('div', { className: 'wide', tabIndex: 0 }, made('table', {},
  made('thead', {}, made('tr', {}, ...heads.map(text => made('th', {}, text)))),
  made('tbody', {}, ...rows.map(cells => made('tr', {}, ...cells.map((text, index) => { const td = made('td', {}, text); td.dataset.name = heads[index]; return td; }))))));

// Asks the program that serves the page, for a part of HTML or for a text.
const ask = async (path, method = 'GET') => {
  const answer = await fetch(path, { method });
  const text = await answer.text();
  if (!answer.ok) throw new Error(text);
  return text;
};
const part = async (holder, path, wait) => {
  const own = asked;
  holder.replaceChildren(made('p', { className: 'note' }, wait));
  try {
    const text = await ask(path);
    if (own === asked) holder.innerHTML = text;
  } catch (error) {
    if (own === asked) holder.replaceChildren(made('p', { className: 'error' }, error.message));
  }
};
const show = row => {
  asked++;
  current = row;
  const number = samples.numbers[row], name = encodeURIComponent(samples.scenario), holder = byId('sample');
  const recording = data.recordings[samples.index][number], twin = made('div'), happened = made('div'), said = made('p', { className: 'note', role: 'status' });
  const near = shown.indexOf(row), step = (text, to) => made('button', { type: 'button', disabled: shown[to] === undefined, onclick: () => show(shown[to]) }, text);
  const buttons = [step('Previous', near - 1), step('Next', near + 1)];
  if (data.is_served) {
    buttons.push(made('button', { type: 'button', onclick: async () => {
      said.textContent = 'The sample runs again, and the viewer starts.';
      try { said.textContent = await ask(`open/${name}/${number}`, 'POST'); } catch (error) { said.textContent = error.message; }
    } }, 'Open in Rerun'));
    if (samples.fates[row] === 2 || samples.fates[row] === 3) buttons.push(made('button', { type: 'button', onclick: () =>
      part(twin, `twin/${name}/${number}`, 'Looking for the smallest case that fails, and for its twin that passes.') }, 'Passing twin'));
  }
  const values = samples.parameters.map(one => [one.label, valueText(one, row)]);
  const outcomes = samples.outcomes[0].map((one, index) => [one.label, ...samples.outcomes.map(of => valueText(of[index], row))]);
  holder.replaceChildren(
    made('h2', {}, `Sample ${number}: ${fateWord(samples.fates[row])}`), made('div', { className: 'buttons' }, ...buttons), said, happened, twin,
    made('h3', {}, 'Parameters'), table(['parameter', 'value'], values),
    made('details', { open: !data.is_served }, made('summary', {}, 'Outcome in each arm'), table(['column', ...samples.arms], outcomes)),
    made('p', {}, 'Run it again, in the campaign’s folder:'),
    made('pre', { className: 'command', tabIndex: 0 }, data.commands[samples.index].replace(data.place, number)));
  if (recording) said.append('Recorded: ', made('a', { href: recording[1], target: '_blank', rel: 'noopener' }, 'incident card'),
    ...(data.is_served ? [] : [', ', made('a', { href: recording[0] }, recording[0])]));
  if (data.is_served) part(happened, `sample/${name}/${number}`, 'The sample runs again.');
  else happened.append(made('ul', {}, ...samples.arms.map((name, index) => made('li', {}, `${name}: ${told(samples.outcomes[index], row)}`))));
  history.replaceState(null, '', `#${name}/${number}`);
  panels.filter(panel => panel.y).forEach(drawPlane);
  // The sample stands above the list and, on a narrow page, below the charts.
  const { top } = holder.getBoundingClientRect();
  if (top < 0 || top > innerHeight) { holder.scrollIntoView(); holder.focus({ preventScroll: true }); }
};

const options = (select, names, chosen) => {
  const before = select.value;
  select.replaceChildren(...names.map(([value, text]) => made('option', { value }, text)));
  select.value = names.some(([value]) => value === before) ? before : chosen ?? names[0]?.[0] ?? '';
};
// Sets up what depends on scenario and arm.
const choose = () => {
  const form = byId('filters').elements;
  if (samples?.index !== form.scenario.selectedIndex) { load(form.scenario.selectedIndex); current = null; }
  arm = Number(form.arm.value);
  const all = columns(), names = all.map(one => [one.name, one.label]), params = samples.parameters.map(one => one.name);
  const numeric = all.filter(one => !one.words).map(one => one.name), liked = name => all.some(one => one.name === name) ? name : undefined;
  const [first, second] = [samples.map[0] ?? params[0] ?? numeric[0], samples.map[1] ?? params[1] ?? numeric[1]];
  const wanted = [first, second, liked('min_ttc_rear_s') ?? numeric[2], liked('collision_delta_v_first_mps') ?? numeric[3]];
  for (const panel of panels) {
    if (panel.id === 'map') { options(panel.x, names, first); options(panel.y, names, second); }
    else if (panel.y) { options(panel.x, names, liked('min_thw_front_s') ?? numeric[0]); options(panel.y, names, liked('min_thw_rear_s') ?? numeric[1]); }
    else options(panel.x, names, wanted[panel.index] ?? names[0][0]);
    clearBrush(panel);
  }
  for (const [name, of] of [['reason', 'mis_reason'], ['cause', 'cause']])
    options(form[name], [['', 'all'], ...(column(of)?.words ?? []).map((word, index) => [String(index), word])], '');
  const present = data.fates.map((_, fate) => fate).filter(fate => samples.fates.includes(fate));
  byId('fates').replaceChildren(made('legend', {}, 'Outcome'), ...present.map(fate => made('label', {}, made('input', { type: 'checkbox', value: fate, checked: true }), ' ',
    made('span', { className: 'key', style: `--key: ${fateColour(fate)}` }, fateWord(fate)))));
};

const watch = panel => {
  let isWaiting = false;
  panel.chart.addEventListener('pointerdown', () => { panel.isDrawn = true; }, true);
  panel.chart.on('plotly_selecting', event => {
    if (isWaiting || !event?.range) return;
    isWaiting = true;
    requestAnimationFrame(() => {
      // The end of the brush has drawn all.
      if (!panel.isDrawn) { isWaiting = false; return; }
      setBrush(panel, event.range);
      update(panel).finally(() => { isWaiting = false; });
    });
  });
  panel.chart.on('plotly_selected', event => {
    // It comes a second time when the brush has been drawn.
    const isEnd = panel.isDrawn && event?.range;
    if (isEnd) { setBrush(panel, event.range); panel.isDrawn = false; }
    update(undefined, !isEnd || panel.shown === JSON.stringify(panel.brush) ? panel : undefined);
  });
  panel.chart.on('plotly_click', event => { const row = event.points.find(point => point.customdata !== undefined)?.customdata; if (row !== undefined) show(row); });
  panel.chart.on('plotly_doubleclick', () => { clearBrush(panel); update(); });
};
const start = async () => {
  const script = made('script', { textContent: await unpacked('plotly') });
  script.nonce = document.currentScript?.nonce || document.querySelector('script[nonce]').nonce;
  document.head.append(script);
  data = JSON.parse(await unpacked('data'));
  byId('data').remove(); byId('plotly').remove();
  panels = [...document.querySelectorAll('.view')].map(element => {
    const of = name => element.querySelector(`[name="${name}"]`);
    return { id: element.id, index: Number(element.id.split('-')[1]), chart: element.querySelector('.chart'), x: of('x'), y: of('y'), from: of('from'), to: of('to'), clear: of('clear'), brush: [] };
  });
  const form = byId('filters'), hash = decodeURIComponent(location.hash.slice(1)).split('/');
  const scenario = data.scenarios.findIndex(one => one.scenario === hash[0]);
  if (scenario > 0) form.elements.scenario.selectedIndex = scenario;
  choose();
  await update();
  panels.forEach(watch);
  for (const panel of panels) {
    for (const select of [panel.x, panel.y]) select?.addEventListener('change', () => { clearBrush(panel); update(); });
    panel.clear.addEventListener('click', () => { clearBrush(panel); update(); panel.x.focus(); });
    for (const input of [panel.from, panel.to]) input?.addEventListener('change', () => {
      const [low, high] = ends(column(panel.x.value)), of = (one, end) => one.value === '' ? end : Number(one.value);
      setBrush(panel, panel.from.value === '' && panel.to.value === '' ? null : { x: [of(panel.from, low), of(panel.to, high)] });
      update();
    });
  }
  // An empty field would be the number 0.
  const field = form.elements.number;
  const number = () => {
    const row = field.value === '' ? undefined : samples.row.get(Number(field.value));
    field.setCustomValidity(row === undefined ? 'No sample of this scenario has this number.' : '');
    if (field.reportValidity()) { show(row); byId('sample').focus(); }
  };
  form.noValidate = true; // each Show checks anew
  form.addEventListener('submit', event => { event.preventDefault(); number(); });
  form.addEventListener('change', event => { if (event.target.name === 'number') return; if (['scenario', 'arm'].includes(event.target.name)) choose(); update(); });
  byId('reset').addEventListener('click', () => { form.elements.reason.value = form.elements.cause.value = ''; choose(); update(); });
  document.addEventListener('keydown', event => { if (event.key === 'Escape') { panels.forEach(clearBrush); update(); } });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    for (const input of document.querySelectorAll('#fates input')) input.nextElementSibling.style.setProperty('--key', fateColour(Number(input.value)));
    update();
  });
  if (hash[1] !== undefined && samples.row.has(Number(hash[1]))) show(samples.row.get(Number(hash[1])));
  document.documentElement.dataset.ready = 'yes';
};
start().catch(error => { byId('counts').textContent = `The explorer does not start: ${error.message}`; });
