const form = document.querySelector('.filters'), entries = [...document.querySelectorAll('.recording')];
const filter = () => {
  const chosen = [...new FormData(form)].filter(([, value]) => value);
  const has = (entry, [name, value]) => name === 'collided' ?
    entry.dataset.collided.split(' ').includes(value) : entry.dataset[name] === value;
  for (const entry of entries) entry.hidden = !chosen.every(choice => has(entry, choice));
  form.querySelector('output').textContent = entries.filter(entry => !entry.hidden).length + ' of ' + entries.length;
};
form.hidden = false; form.addEventListener('change', filter); filter();
for (const box of document.querySelectorAll('.scrubber')) {
  const films = JSON.parse(box.querySelector('script').textContent), slider = box.querySelector('input');
  const texts = box.querySelectorAll('output');
  const roads = [...box.querySelectorAll('svg')].map(road => [...road.querySelectorAll('rect')].slice(1));
  const headway = value => value === null ? 'none' : value > 10 ? '> 10 s' : value.toFixed(2) + ' s';
  const show = () => films.forEach((film, index) => {
    const [time, front, rear, ...at] = film[Math.min(slider.value, film.length - 1)];
    roads[index].forEach((car, actor) => {
      const isThere = at[2 * actor] !== null;
      car.setAttribute('visibility', isThere ? 'visible' : 'hidden');
      if (isThere) car.setAttribute('transform', `translate(${at[2 * actor]} ${at[2 * actor + 1]})`);
    });
    texts[index].textContent = `${time.toFixed(2)} s · headway front ${headway(front)}, rear ${headway(rear)}`;
  });
  slider.addEventListener('input', show); show(); box.hidden = false;
}
