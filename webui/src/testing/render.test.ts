import { createElement, useEffect, useState } from 'react'
import { expect, it } from 'vitest'
import { Page, press } from './render'

function Counter({ from }: { from: number }) {
  const [count, setCount] = useState(from)
  const [seen, setSeen] = useState('')
  useEffect(() => {
    setSeen(`seen ${count}`)
    return () => void ended.push(count)
  }, [count])
  return createElement('button', { onClick: () => setCount(count + 1) }, `${count} ${seen}`)
}
const ended: number[] = []

it('keeps the state of a component, runs its effects, and ends them', async () => {
  const page = new Page(createElement(Counter, { key: 'a', from: 3 }))
  expect(page.text()).toBe('3 seen 3')
  await page.after(() => press(page.one('button')))
  expect(page.text()).toBe('4 seen 4')
  await page.show(createElement(Counter, { key: 'b', from: 7 }))
  expect(page.text()).toBe('7 seen 7')
  expect(ended).toEqual([3, 4])
})
